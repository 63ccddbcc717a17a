# SPDX-License-Identifier: MIT
"""The contour tracker on recorded sequences, and the tables of the shape memory."""

from __future__ import annotations

import pytest

from experiments.contour.contour import follow_davis, open_davis


@pytest.mark.parametrize(("sequence", "by", "least"), [("cows", "mask", 0.82), ("camel", "mask", 0.75)])
def test_recorded_animals_are_followed(data_dir, sequence, by, least):
    if not (data_dir / "davis" / sequence).is_dir():
        pytest.skip(f"recorded data absent: {data_dir / 'davis' / sequence}")
    video = open_davis(data_dir / "davis", sequence, most=40)
    assert follow_davis(video, by).ious.mean() > least


def test_the_tables_are_printed_without_recorded_data(tmp_path, measured):
    tables = measured("shape_memory", "--frames", "30", data=tmp_path)["tables"]
    assert sum(row[0] == "walker" for table in tables for row in table["rows"]) == 7
