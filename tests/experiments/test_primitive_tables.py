# SPDX-License-Identifier: MIT
"""Primitives of the experiments: rows of their tables, and objects of recorded scenes."""

from __future__ import annotations

import pytest

import sdftrack as st
from experiments.primitives.kinds import views
from experiments.primitives.kinect_objects import objects_of


@pytest.fixture
def osd(data_dir):
    folder = data_dir / "osd"
    if not (folder / "camera.json").is_file():
        pytest.skip(f"recorded data absent: {folder}")
    return folder


@pytest.mark.parametrize(
    ("scene", "number", "view"),
    [("43", 2, "right half"), ("33", 5, "whole"), ("36", 2, "upper half"), ("30", 3, "right half")],
)
def test_cut_cans_and_a_mug_are_no_long_cones_and_no_ellipsoids(osd, scene, number, view):
    """With readings counted as independent: a cone of 684 mm, one of 1080 mm, an ellipsoid, a cone of 642 mm."""
    frame, masks = objects_of(osd, scene)
    ((seen, mask, plane),) = [v[1:] for v in views(frame, masks[number]) if v[0] == view]
    fit = st.fit_primitive(seen, mask=mask, plane=plane)
    assert fit.kind == "cylinder", fit.scores
