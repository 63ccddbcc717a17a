# SPDX-License-Identifier: MIT
"""Where the movement of a repetition begins and ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Context
from sdftrack.motion.posterior import MotionSamples

Array = NDArray[np.float64]


def moving(samples: MotionSamples, context: Context) -> NDArray[np.bool_]:
    """(n,) True in the movements of the repetition; everywhere without any."""
    if not context.movements:
        return np.ones(len(samples.times_s), dtype=bool)
    t = samples.times_s
    return np.any([(t >= a - 1e-9) & (t <= b + 1e-9) for a, b in context.movements], axis=0)


Mask = NDArray[np.bool_]

ONSET_PART = 0.05  # of the peak speed
REST_S = 0.1  # a halt shorter than this lies within a movement: hands that hesitate would lose half of theirs
LEAST_PEAK_MPS = 0.005  # an object that never moves faster lies still: slow hands reach 20 mm/s, noise 1 or 2


@dataclass(frozen=True, eq=False)
class Movement:
    """The movement about the largest peak of the speed, for each sample.

    `onset_s` and `offset_s` are NaN where nothing moves, and the ends of the repetition where the speed is not low
    there; `within` (S, n) marks what is between.
    """

    onset_s: Array
    offset_s: Array
    within: Mask

    @property
    def duration_s(self) -> Array:
        """(S,) time from onset to offset."""
        return self.offset_s - self.onset_s


def movement_of(repetition: MotionSamples) -> Movement:
    """Onset and offset: searched from the peak of the speed outward, where the speed falls below 5 % of its peak and
    stays there for 0.1 s or until the repetition ends; between samples by linear interpolation.

    The search begins at the peak of the mean speed of all samples, so that all speak of the same movement where two
    peaks, out and back, are about as high. The threshold is 5 % of each sample's own peak.
    """
    return repetition.kept("movement", lambda: _found(repetition))


def _found(repetition: MotionSamples) -> Movement:
    speed, times = repetition.speeds_mps, repetition.times_s
    start = int(np.argmax(speed.mean(axis=0)))
    peak = speed.max(axis=1)
    threshold = ONSET_PART * peak
    moves = (peak >= LEAST_PEAK_MPS) & (speed[:, start] >= threshold)
    count = max(1, round(REST_S * repetition.rate_hz))
    onset = _last_rest(speed[:, : start + 1], times[: start + 1], threshold, count)
    # The offset is the onset of the movement played backwards.
    offset = _last_rest(speed[:, start:][:, ::-1], times[start:][::-1], threshold, count)
    onset, offset = np.where(moves, onset, np.nan), np.where(moves, offset, np.nan)
    within = (
        (times[:, None] >= onset - 1e-9) & (times[:, None] <= offset + 1e-9)
    ).T  # stored like the samples
    return Movement(onset, offset, within)


def _last_rest(speed: Array, times: Array, threshold: Array, count: int) -> Array:
    """The time at which the last rest before the last sample ends; the first time if there is none."""
    n = speed.shape[1]
    # Rest may have begun before the repetition, so what lies before it counts as rest.
    below = np.pad(speed < threshold[:, None], ((0, 0), (count, 0)), constant_values=True)
    run = np.cumsum(np.pad(below, ((0, 0), (1, 0))), axis=1)
    # Of the `count` samples that end before sample i: n + 1.
    rest_ends: Mask = run[:, count:] - run[:, :-count] == count
    # The first sample after the rest, 0 if it is the padding alone.
    last = n - np.argmax(rest_ends[:, ::-1], axis=1)
    found = (last > 0) & (last < n)
    i = np.clip(last, 1, max(n - 1, 1))
    if n < 2:
        return np.full(len(speed), times[0])
    rows = np.arange(len(speed))
    before, after = speed[rows, i - 1], speed[rows, i]
    rise = np.where(after > before, after - before, 1.0)
    crossing = times[i - 1] + np.clip((threshold - before) / rise, 0, 1) * (times[i] - times[i - 1])
    return np.where(found, crossing, times[0])
