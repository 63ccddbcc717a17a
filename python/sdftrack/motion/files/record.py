# SPDX-License-Identifier: MIT
"""What a file says about one object, before it is checked as a `Trajectory`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import RotationErrors, rigid_pose, rotation
from sdftrack._internal.text_files import named
from sdftrack.motion.trajectory import USABLE, Trajectory

Array = NDArray[np.float64]


@dataclass
class Record:
    """One object of a file; lengths in the unit of the file, NaN in gaps."""

    name: str
    times_s: Array
    poses: Array
    status: list[str]
    covariances: Array | None = None
    frame: str = "camera"


def quaternions_as_poses(positions: Array, quaternions: Array, place: Callable[[int], str]) -> Array:
    """(N, 4, 4) poses of (N, 3) positions and (N, 4) quaternions (x, y, z, w); rows that are not finite become NaN.

    `place` says where row i stands, for errors.
    """
    poses = np.full((len(positions), 4, 4), np.nan)
    known = np.isfinite(positions).all(axis=1) & np.isfinite(quaternions).all(axis=1)
    for i in np.flatnonzero(known).tolist():
        if not quaternions[i].any():
            raise ValueError(
                f"{place(i)}: the quaternion is 0, which is no rotation; write nan where there is no pose"
            )
        poses[i] = np.eye(4)
        with named(place(i)):
            poses[i, :3, :3], poses[i, :3, 3] = rotation(quaternions[i]), positions[i]
    return poses


def matrices_as_poses(matrices: Array, place: Callable[[int], str]) -> Array:
    """(N, 4, 4) poses with the nearest rotations; those that are not finite become NaN.

    Files round: the rotations of single precision, or of a few digits, are orthogonal to that accuracy only.
    """
    poses = np.full_like(matrices, np.nan)
    errors = RotationErrors()
    for i in np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2))).tolist():
        poses[i] = rigid_pose(matrices[i], place(i), errors)
    errors.tell(stacklevel=5)
    return poses


def gaps_as_lost(poses: Array, status: Sequence[str] | None = None) -> list[str]:
    """`status`, or "ok", of each pose, and "lost" where there is none, whatever the status says."""
    known = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
    return [
        given if pose or given not in USABLE else "lost"
        for pose, given in zip(known, status or ["ok"] * len(poses), strict=True)
    ]


def times_from_numbers(numbers: Any, fps: float | None, why: str) -> Array:
    """Times in seconds of numbered images; ValueError without `fps`, where `why` says what is missing."""
    if fps is None:
        raise ValueError(f"{why}; expected the frame rate: fps=30")
    return np.asarray(numbers, np.float64) / fps


TIMER_S = 1e-6  # files with times of six decimals
JITTER = 1e-3  # of a step


def shared_times(trajectories: Sequence[Trajectory], suffix: str) -> Array:
    """The times of all trajectories; ValueError if they differ."""
    first = trajectories[0]
    for t in trajectories[1:]:
        if not np.array_equal(t.times_s, first.times_s):
            raise ValueError(
                f"trajectories: a {suffix} file has one time for all objects, but {t.name!r} has other times than "
                f"{first.name!r}; resample them to common times, or save one file each"
            )
    return first.times_s


def regular_rate_hz(times_s: Array, suffix: str) -> float:
    """Frames per second; ValueError unless all steps are equal, to 0.1 % of a step and a microsecond."""
    if len(times_s) < 2:
        raise ValueError(f"trajectories: a {suffix} file has a frame rate, which takes two frames, got one")
    step = float(times_s[-1] - times_s[0]) / (len(times_s) - 1)
    error = np.abs(times_s - times_s[0] - step * np.arange(len(times_s)))
    if error.max() > JITTER * step + TIMER_S:
        i = int(error.argmax())
        raise ValueError(
            f"trajectories: a {suffix} file has one frame rate, but the times are irregular (frame {i} is "
            f"{1e3 * error[i]:.3g} ms off a rate of {1 / step:.4g} Hz); resample them first"
        )
    return 1 / step
