# SPDX-License-Identifier: MIT
"""Tables taken out of recorded scenes, and corners."""

from __future__ import annotations

import numpy as np
import pytest

import sdftrack as st
from experiments.planes.planes import MAX_HIGH, MIN_TABLE, angle_errors, removed
from experiments.planes.table_scenes import open_scenes
from experiments.synth.room import corner


@pytest.mark.parametrize("method", ["rigid", "bent"])
def test_recorded_tables_are_taken_out_and_objects_stay(data_dir, method):
    if not (data_dir / "osd").is_dir():
        pytest.skip(f"recorded scenes absent: {data_dir / 'osd'}")
    for scene in open_scenes(data_dir):
        share = removed(scene, st.remove_plane(scene.frame, scene.camera, method=method)[0])
        assert share["table"] >= MIN_TABLE, scene.name
        assert share["high"] <= MAX_HIGH, scene.name


def test_the_angles_of_a_corner_are_right_with_the_true_intrinsics():
    seq = corner(1, "kinect", 0)
    assert np.abs(angle_errors(seq, seq.camera)).sum() < 0.1
