# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import sdftrack as st
from sdftrack.testing import assert_pose_close

pytest_plugins = ["sdftrack.testing.fixtures"]


def test_the_fixtures_for_other_suites_make_a_sequence_that_is_tracked(
    sdftrack_sequence, sdftrack_shape, sdftrack_camera
):
    tracker = st.Tracker(sdftrack_shape, sdftrack_camera)
    tracker.start(sdftrack_sequence[0], poses=[sdftrack_sequence.ground_truth[0][0]])
    assert tracker.track(sdftrack_sequence[1]).ok


def test_close_poses_pass_and_others_fail_with_both_distances():
    T = st.geometry.pose([0.1, 0.2, 0.3], [0, 0, 1])
    near = T @ st.geometry.pose([0, 0, 0.01], [0.002, 0, 0])
    assert_pose_close(near, T, 0.0021, 0.0101)
    with pytest.raises(AssertionError, match=r"2 mm and 0\.573 deg"):
        assert_pose_close(near, T, 0.0019, 0.0101)
    with pytest.raises(AssertionError):
        assert_pose_close(near, T, 0.0021, 0.0099)


def test_poses_without_numbers_or_of_another_shape_fail():
    with pytest.raises(AssertionError):
        assert_pose_close(np.full((4, 4), np.nan), np.eye(4), 1.0, 4.0)
    with pytest.raises(AssertionError, match="shape"):
        assert_pose_close(np.eye(3), np.eye(4), 1.0, 4.0)
