# SPDX-License-Identifier: MIT
"""The core decides about a frame: both languages answer alike, and a sequence goes on from a file."""

import pickle

import box_scene
import numpy as np

import sdftrack as st

SAME = 1e-9  # the C library's functions may differ in their last digit
NUMBERS = 12 + 6 + 2  # pose, twist, confidence, inliers


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


def test_a_loaded_tracker_can_search_for_all_of_its_objects_and_for_some(tmp_path):
    shape = box_scene.box_volume()
    poses = [box_scene.pose_at(0, 0, 0.55), box_scene.pose_at(0.2, 0, 0.7)]
    tracker = st.Tracker([shape, shape], box_scene.CAMERA, threads=1)
    frame = st.Frame(box_scene.depth_of(poses, 0))
    tracker.start(frame, poses=poses)
    tracker.save(tmp_path / "tracker")
    again = st.Tracker.load(tmp_path / "tracker")
    assert again.recover(frame).status == ["ok", "ok"]
    again = pickle.loads(pickle.dumps(tracker))
    assert again.recover(frame, k=1).status == tracker.recover(frame, k=1).status
