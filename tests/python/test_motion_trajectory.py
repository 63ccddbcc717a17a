# SPDX-License-Identifier: MIT
"""Trajectories: what is accepted, and what is refused in one line."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import assert_refused, refused

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


@refused(
    (lambda: Trajectory([0, 0.1, 0.1, 0.2], POSES), ValueError, r"repeated at frames 1 and 2 \(0.1"),
    (lambda: Trajectory([0, 0.2, 0.1, 0.3], POSES), ValueError, r"not sorted at frames 1 and 2"),
    (lambda: Trajectory([0, np.nan, 0.1, 0.3], POSES), ValueError, r"needs fps \(--fps\)"),
    (lambda: Trajectory([], np.zeros((0, 4, 4))), ValueError, "at least one"),
    (lambda: Trajectory(list("abcd"), POSES), TypeError, "times_s: expected an array of numbers"),
    (lambda: Trajectory(TIMES[:3], POSES), ValueError, r"poses: expected shape \(3, 4, 4\)"),
    (lambda: Trajectory(TIMES, changed(t=[0, 0, 3000.0])), ValueError, r"3000 m from the origin; in mm\?"),
    (lambda: Trajectory(TIMES, changed(R=2 * np.eye(3))), ValueError, "expected rigid poses"),
    (lambda: Trajectory(TIMES, changed(R=np.diag([1, 1, -1]))), ValueError, "expected rigid poses"),
    (lambda: Trajectory(TIMES, POSES, status=["lost"] * 4, name="cup"), ValueError, "lost in all 4 frames"),
    (lambda: Trajectory(TIMES, POSES, np.zeros((3, 6, 6))), ValueError, r"covariances: .* \(4, 6, 6\)"),
    (lambda: Trajectory(TIMES, POSES, status=["ok"]), ValueError, "status: expected 4 of them"),
)
def test_what_is_no_trajectory_is_refused(call, error, words):
    assert_refused(call, error, words)


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
