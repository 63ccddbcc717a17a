# SPDX-License-Identifier: MIT
"""Repetitions of an exercise: the object leaves its place and comes back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, find_peaks, sosfiltfilt

from sdftrack._internal.validation import of_kind
from sdftrack.motion.posterior import MotionSamples, SmoothedMotion
from sdftrack.motion.spline import angles_between

Array = NDArray[np.float64]


TREMOR_HZ = 3.0  # a held object that trembles faster than this is at rest
MOVING_PART = 0.05  # of the usual peak speed
LEAST_SPEED_MPS, LEAST_TURN_RADPS = 0.005, 0.05
REST_S = 0.1  # shorter halts belong to the movement


Spans = list[tuple[float, float]]


def rests_of(motion: SmoothedMotion, rate_hz: float) -> Spans:
    """(start, end) of rests: 0.1 s and more with speeds below 5 % of their usual peaks, after a 3 Hz low pass."""
    times = motion.times_s(rate_hz)
    mean = motion.mean(times)
    speed = _slow_norm(mean.velocities_mps[0], mean.observed, rate_hz)
    turn = _slow_norm(mean.angular_velocities_radps[0], mean.observed, rate_hz)
    fastest, turning = np.percentile(speed, 98), np.percentile(turn, 98)
    limits = max(MOVING_PART * fastest, LEAST_SPEED_MPS), max(MOVING_PART * turning, LEAST_TURN_RADPS)
    # A gap is no rest: what was not seen may have moved.
    resting = (speed < limits[0]) & (turn < limits[1]) & mean.observed
    return [
        (float(times[a]), float(times[b - 1]))
        for a, b in runs(resting)
        if times[b - 1] - times[a] >= REST_S or a == 0 or b == len(times)
    ]


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


BY = ("auto", "position", "rotation")
LEAST_MOVE_M, LEAST_TURN_RAD = 0.03, float(np.radians(10))
HOME_S = 0.2  # the place at the start is the median over this time
SAMPLES_RATE_HZ = 12.5
FLAT = 0.5  # distances from the start that vary by less than this part of the range do not tell cycles apart


@dataclass(frozen=True, eq=False)
class Excursion:
    """How far the object is from its place: metres, or radians with `by` "rotation"."""

    # `by` may also be "direction": along the `direction` of the largest motion, for cycles that go around their start.
    # `largest` is the 98th percentile, `home` the position (3,) or rotation (3, 3) at the start.

    times_s: Array
    values: Array
    largest: float
    by: str
    home: Array
    direction: Array | None = None


def excursion_of(motion: SmoothedMotion, rate_hz: float, by: str = "auto") -> Excursion | None:
    """The excursion of the mean movement; None if the object moves by less than 30 mm and turns by less than 10 deg."""
    if by not in BY:
        raise ValueError(f"by: expected one of {', '.join(BY)}, got {by!r}")
    times = motion.times_s(rate_hz)
    mean = motion.mean(times)
    first = np.flatnonzero(mean.observed)[: max(1, round(HOME_S * rate_hz))]
    home = np.median(mean.positions_m[0, first], axis=0)
    distance = _filled(np.linalg.norm(mean.positions_m[0] - home, axis=1))
    start = mean.rotations[0, first[len(first) // 2]]
    if by == "position" or (by == "auto" and np.percentile(distance, 98) >= LEAST_MOVE_M):
        return _around_or_from(times, distance, mean, home)
    turned = _filled(angles_between(mean.rotations[0], start))
    largest = float(np.percentile(turned, 98))
    if by == "rotation" or largest >= LEAST_TURN_RAD:
        return Excursion(times, turned, largest, "rotation", start)
    return None


def excursions_of_samples(motion: SmoothedMotion, found: Excursion) -> Array:
    """(S, n) excursions of the samples, at fewer times: repetitions take longer than a second."""
    samples = motion.samples(motion.times_s(SAMPLES_RATE_HZ))
    if found.by == "rotation":
        return np.array([_filled(angles_between(R, found.home)) for R in samples.rotations])
    moved = samples.positions_m - found.home
    if found.direction is not None:
        along = moved @ found.direction
        return np.array([_filled(row - np.nanmin(row)) for row in along])
    return np.array([_filled(row) for row in np.linalg.norm(moved, axis=-1)])


def _around_or_from(times: Array, distance: Array, mean: MotionSamples, home: Array) -> Excursion:
    """The distance from the start, or, if the object circles about its start, the way along its main direction."""
    x = mean.positions_m[0]
    largest = float(np.percentile(distance, 98))
    moving = distance > 0.5 * largest
    known = x[mean.observed]
    axes = np.linalg.svd(known - known.mean(axis=0), full_matrices=False)[2]
    along = _filled((x - home) @ axes[0])
    low, high = np.percentile(along, [2, 98])
    # Which way the main direction points is arbitrary.
    both_ways = min(high, -low) > 0.3 * max(high, -low)
    if np.mean(moving) > FLAT and np.ptp(distance[moving]) < FLAT * (high - low) and both_ways:
        return Excursion(times, along - along.min(), float(high - low), "direction", home, axes[0])
    return Excursion(times, distance, largest, "position", home)


def _filled(values: Array) -> Array:
    """Gaps hold the last value: what happened in them is unknown, and nothing is counted there."""
    known = np.flatnonzero(np.isfinite(values))
    return np.asarray(
        values[known[np.clip(np.searchsorted(known, np.arange(len(values)), "right") - 1, 0, None)]]
    )


PROMINENCE = 0.25  # of the largest excursion; smaller ones are hesitations
NEAR = 0.35  # of a repetition's excursion: rests below are at the place where it starts or ends
RATE_HZ = 50.0


@dataclass(frozen=True)
class Phase:
    """A stretch of a repetition: "move" (out, or there and back without a halt), "hold" or "return"; s."""

    name: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class Repetition:
    """From the start of the first movement to the end of the last one, s."""

    start_s: float
    end_s: float
    phases: tuple[Phase, ...] = ()

    def __post_init__(self) -> None:
        if not (np.isfinite([self.start_s, self.end_s]).all() and self.start_s < self.end_s):
            raise ValueError(f"repetition: expected start_s < end_s, got {self.start_s} and {self.end_s}")

    @property
    def movements(self) -> tuple[Phase, ...]:
        """The phases in which the object moves; without phases the whole repetition."""
        moving = tuple(p for p in self.phases if p.name != "hold")
        return moving or (Phase("move", self.start_s, self.end_s),)


def find_repetitions(
    motion: SmoothedMotion, *, by: str = "auto", spans_s: Sequence[tuple[float, float]] | None = None
) -> list[Repetition]:
    """Find the repetitions of an exercise and their phases.

    A repetition is an excursion from the place (or, `by` "rotation", the orientation) where the object is at first: a
    maximum of the distance from there that stands out by a quarter of the largest one. It starts and ends where the
    object rests, or, in a continuous movement such as drawing circles, where the distance is smallest.

    Parameters
    ----------
    motion : SmoothedMotion
    by : "auto", "position" or "rotation"
        "auto": position if the object moves by 30 mm or more.
    spans_s : list of (start, end), optional
        Repetitions set by hand; only their phases are found.

    Returns
    -------
    list of Repetition
        In order of time; empty if nothing moves.
    """
    of_kind(motion, SmoothedMotion, "motion")
    found = excursion_of(motion, RATE_HZ, by)
    if found is None and spans_s is None:
        return []
    rests = rests_of(motion, RATE_HZ)
    if spans_s is not None:
        spans = [(float(a), float(b)) for a, b in spans_s]
    else:
        assert found is not None
        spans = _spans(found, rests)
    return [Repetition(a, b, tuple(_phases(a, b, rests))) for a, b in spans]


def count_interval(motion: SmoothedMotion, *, by: str = "auto") -> tuple[int, int, int]:
    """The number of repetitions, and the 95 % interval of it over the samples of the posterior."""
    found = excursion_of(motion, RATE_HZ, by)
    if found is None:
        return 0, 0, 0
    counts = [len(_peaks(row, found)) for row in excursions_of_samples(motion, found)]
    low, high = np.percentile(counts, [2.5, 97.5])
    return len(_peaks(found.values, found)), int(np.floor(low)), int(np.ceil(high))


def _peaks(values: Array, found: Excursion) -> NDArray[np.int64]:
    prominence = PROMINENCE * found.largest
    # Of cycles about the start, a recording begins and ends between two extremes.
    if found.direction is not None:
        return np.asarray(find_peaks(values, prominence=prominence)[0])
    # Padded: an excursion that the recording cuts is one, too.
    padded = np.concatenate([[0.0], values, [0.0]])
    return np.asarray(find_peaks(padded, prominence=prominence)[0] - 1)


def _spans(found: Excursion, rests: Spans) -> Spans:
    """Start and end of the excursion about each peak."""
    e, t = found.values, found.times_s
    peaks = _peaks(e, found)
    valleys = [0, *(a + int(np.argmin(e[a : b + 1])) for a, b in pairwise(peaks)), len(e) - 1]
    spans = []
    for k, peak in enumerate(peaks):
        left, right = valleys[k], valleys[k + 1]
        start = _edge(e, t, rests, peak, left, before=True)
        end = _edge(e, t, rests, peak, right, before=False)
        if end > start:
            spans.append((start, end))
    return spans


def _edge(e: Array, t: Array, rests: Spans, peak: int, valley: int, before: bool) -> float:
    """Where the movement about `peak` leaves the rest at `valley`, or `valley` itself if the object does not rest."""
    near = e[valley] + NEAR * (e[peak] - e[valley])
    low, high = min(t[valley], t[peak]), max(t[valley], t[peak])
    for start, end in reversed(rests) if before else rests:
        at = end if before else start
        if low - 1e-9 <= at <= high + 1e-9 and e[min(int(np.searchsorted(t, at)), len(e) - 1)] <= near:
            return at
    return float(t[valley])


def _phases(start: float, end: float, rests: Spans) -> list[Phase]:
    """Movements and the holds between them; the last movement is the return if there was a hold."""
    holds = [(max(a, start), min(b, end)) for a, b in rests if a > start + 1e-9 and b < end - 1e-9]
    if not holds:
        return [Phase("move", start, end)]
    phases, at = [], start
    for a, b in holds:
        phases += [Phase("move", at, a), Phase("hold", a, b)]
        at = b
    return [*phases, Phase("return", at, end)]
