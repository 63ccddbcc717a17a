# SPDX-License-Identifier: MIT
"""Starts that are told something wrong: one clear line, or a doubted result with its reason; never a sure one."""

import numpy as np
import pytest
from test_start_by_click import CAMERA, RIGHT_M, adds, table_scene

import sdftrack as st


@pytest.fixture(scope="module")
def scene():
    frame, box, T, mask = table_scene(other=True)
    r, g, b = np.moveaxis(frame.color.astype(int), -1, 0)
    return frame, box, T, mask, (b > 140) & (r < 110) & (g < 110)


def again(frame, seed):
    """The same view with other noise."""
    noise = np.random.default_rng(seed).normal(0, 0.0005, frame.depth.shape)
    return st.Frame(np.where(frame.depth > 0, frame.depth + noise, 0).astype(np.float32), frame.color)


def test_a_box_that_holds_two_objects_of_the_shape_gives_one_of_them_and_says_so(scene):
    frame, box, _, mask, other = scene
    v, u = np.nonzero(mask | other)
    around = (u.min() - 5, v.min() - 5, np.ptp(u) + 10, np.ptp(v) + 10)
    tracker = st.Tracker(box, CAMERA, threads=1)
    result = tracker.start(frame, boxes=around)
    for seed in range(3):
        assert str(result.status[0]) == "weak"
        assert "ambiguous" in result.reason[0]
        assert st.metrics.iou(box.silhouette(CAMERA, result.pose), mask | other) > 0.3
        result = tracker.track(again(frame, seed))


@pytest.mark.parametrize(
    "place", [(300, 60, 170, 520), (380, 80, 60, 80), (370, 60, 100, 110), (20, 200, 100, 150)]
)
def test_a_mask_of_the_table_or_the_wall_is_never_sure(scene, place):
    frame, box, _, mask, other = scene
    y, x, h, w = place
    table = np.zeros(CAMERA.shape, bool)
    table[y : y + h, x : x + w] = True
    tracker = st.Tracker(box, CAMERA, threads=1)
    result = tracker.start(frame, masks=table & ~(mask | other))
    for seed in range(3):
        assert str(result.status[0]) in ("weak", "lost")
        assert result.reason[0]
        result = tracker.track(again(frame, seed))


def test_the_object_itself_is_found_in_the_same_scene(scene):
    frame, box, T, mask, _ = scene
    tracker = st.Tracker(box, CAMERA, threads=1)
    assert adds(tracker.start(frame, masks=mask), T, box) < RIGHT_M
