# SPDX-License-Identifier: MIT
"""Tables taken out of recorded scenes."""

from __future__ import annotations

import pytest

import sdftrack as st
from experiments.planes.planes import MAX_HIGH, MIN_TABLE
from experiments.thesis.measures.table_shares import removed
from experiments.thesis.scenes.table_scenes import open_scenes


@pytest.mark.parametrize("method", ["rigid", "bent"])
def test_recorded_tables_are_taken_out_and_objects_stay(data_dir, method):
    if not (data_dir / "osd").is_dir():
        pytest.skip(f"recorded scenes absent: {data_dir / 'osd'}")
    for scene in open_scenes(data_dir):
        share = removed(scene, st.remove_plane(scene.frame, scene.camera, method=method)[0])
        assert share["table"] >= MIN_TABLE, scene.name
        assert share["high"] <= MAX_HIGH, scene.name


def test_the_evaluation_prints_both_tables(data_dir, capsys, tmp_path, measured):
    folder = tmp_path / "osd"
    folder.mkdir()
    if not (data_dir / "osd").is_dir():
        pytest.skip(f"recorded scenes absent: {data_dir / 'osd'}")
    for name in ("camera.json", "learn00_depth.png", "learn00_label.png"):
        (folder / name).symlink_to(data_dir / "osd" / name)
    shares, _, corners = measured("planes", "--corners", "1", data=tmp_path)["tables"]
    printed = capsys.readouterr().out
    assert "learn00" in printed
    assert "600 600 300 200" in printed
    rows = shares["numbers"]
    assert rows["rigid"]["learn00"]["objects"] < 0.5 * rows["ransac"]["learn00"]["objects"]
    assert corners["numbers"]["kinect, true intrinsics"]["sum_most_deg"] < 0.1
