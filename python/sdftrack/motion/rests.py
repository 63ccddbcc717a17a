# SPDX-License-Identifier: MIT
"""When an object rests: neither its position nor its orientation changes by more than tremor and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from sdftrack.motion.posterior import SmoothedMotion

__all__ = ["REST_S", "Rests", "rests_of"]

Array = NDArray[np.float64]
TREMOR_HZ = 3.0  # a held object that trembles faster than this is at rest
MOVING_PART = 0.05  # of the usual peak speed
LEAST_SPEED_MPS, LEAST_TURN_RADPS = 0.005, 0.05
REST_S = 0.1  # shorter halts belong to the movement


@dataclass(frozen=True)
class Rests:
    """Times (start, end) of the rests, s, and the thresholds of speed and angular speed that bound them."""

    spans: list[tuple[float, float]]
    speed_mps: float
    turn_radps: float


def rests_of(motion: SmoothedMotion, rate_hz: float) -> Rests:
    """Rests of at least 0.1 s: speed and angular speed below 5 % of their usual peaks, after a 3 Hz low pass."""
    times = motion.times_s(rate_hz)
    mean = motion.mean(times)
    speed = _slow_norm(mean.velocities_mps[0], mean.observed, rate_hz)
    turn = _slow_norm(mean.angular_velocities_radps[0], mean.observed, rate_hz)
    fastest, turning = np.percentile(speed, 98), np.percentile(turn, 98)
    limits = max(MOVING_PART * fastest, LEAST_SPEED_MPS), max(MOVING_PART * turning, LEAST_TURN_RADPS)
    # A gap is no rest: what was not seen may have moved.
    resting = (speed < limits[0]) & (turn < limits[1]) & mean.observed
    spans = []
    for a, b in runs(resting):
        start, end = times[a], times[b - 1]
        if end - start >= REST_S or a == 0 or b == len(times):
            spans.append((float(start), float(end)))
    return Rests(spans, *limits)


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first, behind the last) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _slow_norm(values: Array, observed: NDArray[np.bool_], rate_hz: float) -> Array:
    """Norm after a low pass of zero phase; 0 in gaps."""
    out = np.zeros(len(values))
    sos = butter(2, TREMOR_HZ, fs=rate_hz, output="sos")
    for a, b in runs(observed):
        part = values[a:b]
        # Padding longer than the part is not possible; so short a part is left as it is.
        if b - a > 16:
            part = sosfiltfilt(sos, part, axis=0, padtype="constant", padlen=min(b - a - 1, int(rate_hz)))
        out[a:b] = np.linalg.norm(part, axis=1)
    return out
