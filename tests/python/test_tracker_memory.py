# SPDX-License-Identifier: MIT
"""A tracker holds the volumes of its objects, and of no others."""

import gc
import weakref

import numpy as np
import pytest
from tracking_scene import CAMERA, POSE, SIZE_M, frame_of

import sdftrack as st

BOX = st.SDF.box(SIZE_M, voxels=32)


def painted_box(voxels=24, size=SIZE_M):
    box = st.SDF.box(size, voxels=voxels)
    colors = np.zeros((*box.values.shape, 4), np.uint8)
    colors[...] = (200, 40, 40, 255)
    return st.SDF(box.values, box.voxel_size, box.origin, colors)


def held(reference):
    gc.collect()
    return reference() is not None


@pytest.mark.parametrize("painted", [False, True])
def test_the_volume_of_an_object_that_was_removed_is_free(painted):
    tracker = st.Tracker(BOX, CAMERA)
    shape = painted_box() if painted else st.SDF.box(SIZE_M, voxels=24)
    kept = [weakref.ref(shape._values)]
    k = tracker.add(shape, pose=POSE)
    if painted:
        kept += [weakref.ref(array) for array in tracker._painted[-1]]
    del shape
    assert all(held(one) for one in kept)
    tracker.start(frame_of(), poses=[POSE, POSE])
    tracker.remove(k)
    assert not any(held(one) for one in kept)
    assert tracker.track(frame_of()).status[0] == "ok"


def test_a_shape_that_two_objects_share_stays_with_the_second():
    tracker = st.Tracker([BOX, BOX], CAMERA)
    shape = painted_box()
    kept = weakref.ref(shape._values)
    first, second = tracker.add(shape), tracker.add(shape)
    del shape
    tracker.remove(first)
    assert held(kept)
    tracker.remove(second - 1)
    assert not held(kept)


def test_a_shape_that_is_refused_is_not_held_and_changes_nothing():
    tracker = st.Tracker(BOX, CAMERA)
    tracker.start(frame_of(), poses=[POSE])
    outside = st.SDF(np.ones((8, 8, 8), np.float32), 0.01, [0, 0, 0])
    kept = weakref.ref(outside._values)
    with pytest.raises(ValueError, match="no inside"):
        tracker.add(outside, pose=POSE)
    del outside
    assert not held(kept)
    assert len(tracker.shapes) == 1
    assert tracker.track(frame_of()).status[0] == "ok"
