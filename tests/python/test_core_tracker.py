# SPDX-License-Identifier: MIT
"""The core decides about a frame: both languages answer alike, and a sequence goes on from a file."""

import pathlib
import pickle
import re

import box_scene
import numpy as np
import pytest
import tracking_scene

import sdftrack as st
from sdftrack import geometry

SAME = 1e-9  # the C library's functions may differ in their last digit
NUMBERS = 12 + 6 + 2  # pose, twist, confidence, inliers
# Written by version 0.1: a box of 24 voxels, followed for two frames, names=["crate"].
EARLIER = pathlib.Path(__file__).parents[1] / "data" / "tracker_of_0_1.pickle"


def test_the_python_tracker_answers_a_sequence_as_the_core_does():
    """tests/cpp/test_tracker.cpp compares the core with the same file."""
    expected = box_scene.EXPECTED.read_text().splitlines()
    found = list(box_scene.lines(box_scene.answers()))
    assert len(found) == len(expected)
    for line, wanted in zip(found, expected, strict=True):
        a, b = line.split(" "), wanted.split(" ")
        assert a[:4] == b[:4]  # call, index, object, status
        assert a[4 + NUMBERS :] == b[4 + NUMBERS :]  # reason
        np.testing.assert_allclose(
            np.array(a[4 : 4 + NUMBERS], float), np.array(b[4 : 4 + NUMBERS], float), rtol=0, atol=SAME
        )


def third_frame():
    moved = geometry.pose([0, 0, 0], [0.004, 0, 0]) @ tracking_scene.POSE
    return tracking_scene.frame_of(moved, seed=2, timestamp=0.2), moved


def test_a_file_of_an_earlier_version_goes_on_where_it_was():
    frame, truth = third_frame()
    tracker = st.Tracker.load(EARLIER, trust_pickle=True)
    assert tracker.names == ["crate"]
    result = tracker.track(frame)
    assert (result.index, result.status) == (2, ["ok"])
    st.testing.assert_pose_close(result.pose, truth, 1e-3, np.radians(1))
    assert result.twists[0, 0] == pytest.approx(0.02, abs=0.002)  # from the pose and the time in the file


def test_a_loaded_tracker_can_search_for_all_of_its_objects_and_for_some_after_a_frame():
    frame, _ = third_frame()
    assert st.Tracker.load(EARLIER, trust_pickle=True).recover(frame, k=0).index == 1
    shape = box_scene.box_volume()
    poses = [box_scene.pose_at(0, 0, 0.55), box_scene.pose_at(0.2, 0, 0.7)]
    tracker = st.Tracker([shape, shape], box_scene.CAMERA, threads=1)
    frame = st.Frame(box_scene.depth_of(poses, 0))
    tracker.start(frame, poses=poses)
    again = pickle.loads(pickle.dumps(tracker))
    with pytest.raises(RuntimeError, match=r"recover: call track\(frame\) first"):
        again.recover(frame, k=1)
    again.track(frame)
    assert again.recover(frame, k=1).status[0] == "ok"


def test_nobody_outside_reaches_into_the_core_of_a_tracker():
    package = pathlib.Path(st.__file__).parent
    inside = re.compile(r"tracker\._\w+")
    for path in package.rglob("*.py"):
        if path.parent.name != "tracking":
            found = inside.findall(path.read_text())
            assert not found, f"{path.relative_to(package)}: {found}; ask sdftrack.tracking.interface"
