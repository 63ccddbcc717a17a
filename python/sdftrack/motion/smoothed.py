# SPDX-License-Identifier: MIT
"""The smoothed movement as a trajectory, for files of other programs."""

from __future__ import annotations

import dataclasses

import numpy as np

from sdftrack.motion.posterior import SmoothedMotion
from sdftrack.motion.trajectory import Trajectory

__all__ = ["smoothed_trajectory"]


def smoothed_trajectory(motion: SmoothedMotion, rate_hz: float | None = None) -> Trajectory:
    """Most probable poses at regular times; "lost" in gaps.

    Parameters
    ----------
    motion : SmoothedMotion
    rate_hz : float, optional
        None: the frame rate of what was smoothed.
    """
    times = motion.times_s(motion.trajectory.rate_hz if rate_hz is None else rate_hz)
    mean = motion.mean(times)
    poses = np.full((len(times), 4, 4), np.nan)
    poses[mean.observed] = np.eye(4)
    poses[:, :3, :3][mean.observed] = mean.rotations[0, mean.observed]
    poses[:, :3, 3][mean.observed] = mean.positions_m[0, mean.observed]
    status = np.where(mean.observed, "ok", "lost").tolist()
    return dataclasses.replace(motion.trajectory, times_s=times, poses=poses, covariances=None, status=status)
