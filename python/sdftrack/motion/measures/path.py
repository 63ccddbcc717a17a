# SPDX-License-Identifier: MIT
"""Length and straightness of the path of a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Context, measure
from sdftrack.motion.measures.movement import movement_of
from sdftrack.motion.measures.repetition import moving, on_repetition
from sdftrack.motion.samples import MotionSamples

__all__ = ["index_of_curvature", "path_length"]

Array = NDArray[np.float64]
LARGEST_INDEX = 10.0  # a path that ends nearer to its start than a tenth of its length is closed, not crooked


def _steps(samples: MotionSamples) -> Array:
    """(S, n - 1) distances from sample to sample."""
    return np.asarray(np.linalg.norm(np.diff(samples.positions_m, axis=1), axis=-1))


@measure(
    "path_length",
    "Path length",
    "m",
    "Sum of the distances between consecutive positions (100 Hz) of the point in the movements of the repetition; "
    "rests and holds are left out, in which only noise and tremor would be added up.",
    "Schwarz et al. 2022, doi 10.1186/s12984-021-00979-0",
    wide=0.2,
)
@on_repetition
def path_length(samples: MotionSamples, context: Context) -> Array:
    within = moving(samples, context)
    return np.asarray((_steps(samples) * (within[1:] & within[:-1])).sum(axis=1))


@measure(
    "index_of_curvature",
    "Index of curvature",
    "1",
    "Path length from onset to offset divided by the distance between the positions at onset and offset: 1 for a "
    "straight line; undefined above 10 (a path that returns) and where nothing moves.",
    "Index of curvature in Mohamed Refai et al. 2021, doi 10.1186/s12984-021-00949-6",
    wide=0.2,
    of="movement",
)
@on_repetition
def index_of_curvature(samples: MotionSamples, context: Context) -> Array:
    within = movement_of(samples).within
    length = (_steps(samples) * (within[:, 1:] & within[:, :-1])).sum(axis=1)
    rows, n = np.arange(len(within)), within.shape[1]
    first, last = within.argmax(axis=1), n - 1 - within[:, ::-1].argmax(axis=1)
    distance = np.linalg.norm(samples.positions_m[rows, last] - samples.positions_m[rows, first], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        index = length / distance
    return np.where((length > 0) & (index <= LARGEST_INDEX), index, np.nan)
