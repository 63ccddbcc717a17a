# SPDX-License-Identifier: MIT
"""Tables taken out of recorded scenes, and corners."""

from __future__ import annotations

import pytest

import sdftrack as st
from experiments.planes.planes import MAX_HIGH, MIN_TABLE, removed
from experiments.planes.table_scenes import open_scenes


@pytest.mark.parametrize("method", ["rigid", "bent"])
def test_recorded_tables_are_taken_out_and_objects_stay(data_dir, method):
    if not (data_dir / "osd").is_dir():
        pytest.skip(f"recorded scenes absent: {data_dir / 'osd'}")
    for scene in open_scenes(data_dir):
        share = removed(scene, st.remove_plane(scene.frame, scene.camera, method=method)[0])
        assert share["table"] >= MIN_TABLE, scene.name
        assert share["high"] <= MAX_HIGH, scene.name
