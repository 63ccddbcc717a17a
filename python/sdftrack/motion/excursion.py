# SPDX-License-Identifier: MIT
"""The distance of an object from where it starts, over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.posterior import SmoothedMotion
from sdftrack.motion.quaternion_curves import angles_between
from sdftrack.motion.samples import MotionSamples

__all__ = ["Excursion", "excursion_of", "excursions_of_samples"]

Array = NDArray[np.float64]
BY = ("auto", "position", "rotation")
LEAST_MOVE_M, LEAST_TURN_RAD = 0.03, float(np.radians(10))
HOME_S = 0.2  # the place at the start is the median over this time
SAMPLES_RATE_HZ = 12.5
FLAT = 0.5  # distances from the start that vary by less than this part of the range do not tell cycles apart


@dataclass(frozen=True, eq=False)
class Excursion:
    """How far the object is from its place: metres, or radians with `by` "rotation".

    Attributes
    ----------
    times_s, values : (n,) float64
    largest : float
        98th percentile.
    by : str
        "position", "rotation", or "direction": along the direction of the largest motion, for cycles that go around
        their start.
    home : array
        Position (3,) or rotation (3, 3) at the start.
    direction : (3,) array or None
    """

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
