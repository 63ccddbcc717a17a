# SPDX-License-Identifier: MIT
"""Trajectories: what is accepted, and what is refused in one line."""

from __future__ import annotations

import numpy as np
import pytest

from sdftrack.motion import Trajectory

POSES = np.tile(np.eye(4), (4, 1, 1))
TIMES = np.arange(4) / 30


def changed(**pose):
    T = POSES.copy()
    for name, value in pose.items():
        if name == "t":
            T[2, :3, 3] = value
        else:
            T[2, :3, :3] = value
    return T


@pytest.mark.parametrize(
    ("times", "poses", "message"),
    [
        ([0, 0.1, 0.1, 0.2], POSES, r"repeated at frames 1 and 2 \(0.1"),
        ([0, 0.2, 0.1, 0.3], POSES, r"not sorted at frames 1 and 2"),
        ([0, np.nan, 0.1, 0.3], POSES, r"needs fps \(--fps\)"),
        ([], np.zeros((0, 4, 4)), "at least one"),
        (TIMES[:3], POSES, r"poses: expected shape \(3, 4, 4\)"),
        (TIMES, changed(t=[0, 0, 3000.0]), r"3000 m from the origin; in mm\?"),
        (TIMES, changed(R=2 * np.eye(3)), "expected rigid poses"),
        (TIMES, changed(R=np.diag([1, 1, -1])), "expected rigid poses"),
    ],
)
def test_bad_poses_and_times(times, poses, message):
    with pytest.raises(ValueError, match=message):
        Trajectory(times, poses)


def test_an_object_that_is_lost_in_all_frames():
    with pytest.raises(ValueError, match="lost in all 4 frames"):
        Trajectory(TIMES, POSES, status=["lost"] * 4, name="cup")


def test_text_instead_of_numbers():
    with pytest.raises(TypeError, match="times_s: expected an array of numbers"):
        Trajectory(list("abcd"), POSES)


def test_covariances_and_status_of_another_length():
    with pytest.raises(ValueError, match=r"covariances: expected shape \(4, 6, 6\)"):
        Trajectory(TIMES, POSES, np.zeros((3, 6, 6)))
    with pytest.raises(ValueError, match="status: expected 4 of them"):
        Trajectory(TIMES, POSES, status=["ok"])


def test_lost_poses_may_be_anything():
    trajectory = Trajectory(TIMES, changed(t=[np.nan] * 3), status=["ok", "weak", "lost", "bad_frame"])
    assert trajectory.usable.tolist() == [True, True, False, False]


def test_part_rate_and_duration():
    trajectory = Trajectory(TIMES, POSES, np.tile(np.eye(6), (4, 1, 1)), name="cup")
    part = trajectory.part(slice(1, None, 2))
    assert part.times_s.tolist() == [1 / 30, 3 / 30]
    assert (part.name, len(part), len(part.covariances)) == ("cup", 2, 2)
    assert trajectory.rate_hz == pytest.approx(30)
    assert trajectory.duration_s == pytest.approx(0.1)
