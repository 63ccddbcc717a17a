# SPDX-License-Identifier: MIT
"""Measures of a target: time in it, entries, distances and the error at the end of a movement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Context, Definition
from sdftrack.motion.measures.repetition import on_repetition
from sdftrack.motion.measures.runs import beginnings, settled
from sdftrack.motion.measures.targets import Path, Target
from sdftrack.motion.samples import MotionSamples

__all__ = ["definitions_of_target"]

Array = NDArray[np.float64]


def definitions_of_target(target: Target, number: int) -> list[Definition]:
    """Measures of a target: time in it, entries, nearest and mean distance, error at the end."""
    what = {"Sphere": "sphere", "Box": "box", "Path": "path"}[type(target).__name__]

    @on_repetition
    def time_inside(samples: MotionSamples, context: Context) -> Array:
        return np.asarray((target.distances(samples.positions_m) <= 0).sum(axis=1) / samples.rate_hz)

    @on_repetition
    def nearest(samples: MotionSamples, context: Context) -> Array:
        return np.asarray(np.maximum(target.distances(samples.positions_m), 0).min(axis=1))

    @on_repetition
    def mean_distance(samples: MotionSamples, context: Context) -> Array:
        return np.asarray(np.maximum(target.distances(samples.positions_m), 0).mean(axis=1))

    @on_repetition
    def entries(samples: MotionSamples, context: Context) -> Array:
        inside = target.distances(samples.positions_m) <= 0
        return np.asarray(beginnings(settled(inside, samples.rate_hz)).sum(axis=1), np.float64)

    @on_repetition
    def error(samples: MotionSamples, context: Context) -> Array:
        end = context.movements[0][1] if context.movements else context.end_s
        k = int(np.clip(np.searchsorted(samples.times_s, end - 1e-9), 0, len(samples.times_s) - 1))
        return np.asarray(np.linalg.norm(samples.positions_m[:, k] - target.aim_m, axis=-1))

    aim = "the last point of the path" if isinstance(target, Path) else "its centre"
    source = "Distance of a point from a shape"
    name, label = f"target{number}", f"target {number} ({what})"
    return [
        Definition(
            f"{name}_time", f"Time in {label}", "s",
            f"Time of the repetition in which the point is in {label}.", source, 0.3, False, time_inside,
        ),
        Definition(
            f"{name}_nearest", f"Nearest distance from {label}", "m",
            f"Smallest distance of the point from {label} in the repetition, 0 inside.", source, 0.01, False, nearest,
        ),
        Definition(
            f"{name}_mean", f"Mean distance from {label}", "m",
            f"Mean distance of the point from {label} over the repetition, 0 inside.", source, 0.01, False,
            mean_distance,
        ),
        Definition(
            f"{name}_entries", f"Entries into {label}", "1",
            f"Number of times that the point comes into {label}, a start inside as one: stays and absences shorter "
            "than 0.1 s are not counted.", source, 2, False, entries,
        ),
        Definition(
            f"{name}_error", f"Error at the end for {label}", "m",
            f"Distance of the point from {aim} at the end of the first movement of the repetition, or of the "
            "repetition where its movements are not told apart.", source, 0.01, False, error,
        ),
    ]  # fmt: skip
