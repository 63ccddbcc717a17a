# SPDX-License-Identifier: MIT
"""Times of files that have one column of them, or one rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sdftrack.motion.files.record import Array
from sdftrack.motion.trajectory import Trajectory

__all__ = ["regular_rate_hz", "shared_times"]

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
