# SPDX-License-Identifier: MIT
"""Where a silhouette has been, and so where it should be now."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.placement import Placement

__all__ = ["Course", "Expected"]

Array: TypeAlias = NDArray[np.float64]
REMEMBERED = 8  # frames that a prediction is made of
FADING = 4.0  # frames after which one counts for a third
LEAST_VELOCITY = 0.1  # of the weights, added to the velocity's: a few frames do not make a flight
SCATTERS = 60  # frames whose misses say how far off a prediction is
FIRST = 6  # misses, before which the scatter is a guess
GUESS = 0.02
LARGEST_MISS = 0.2  # of the size: one jump does not make all later ones likely


@dataclass(frozen=True)
class Expected:
    """A prediction: place and size in the image, and how far off such predictions have been, over the size."""

    center_px: Array
    size_px: float
    off_place: float
    off_size: float


class Course:
    """Places and sizes of the last frames, each with a weight; straight on for the place, steady for the size."""

    def __init__(self) -> None:
        self._times: deque[int] = deque(maxlen=REMEMBERED)
        self._states: deque[Array] = deque(maxlen=REMEMBERED)
        self._weights: deque[float] = deque(maxlen=REMEMBERED)
        self._misses: deque[Array] = deque(maxlen=SCATTERS)

    def __len__(self) -> int:
        return len(self._times)

    def add(self, time: int, placement: Placement, weight: float = 1.0) -> None:
        """Take a frame in; a weight of 1 is that of one that is sure."""
        if weight >= 1 and len(self) >= FIRST:
            there = self.expected(time)
            place = (placement.center_px - there.center_px) / there.size_px
            self._misses.append(np.array([*place, np.log(placement.size_px / there.size_px)]))
        self._times.append(time)
        self._states.append(np.array([*placement.center_px, np.log(placement.size_px)]))
        self._weights.append(weight)

    def forget(self) -> None:
        """Drop the places, not how far off predictions are."""
        for kept in (self._times, self._states, self._weights):
            kept.clear()

    def expected(self, time: int) -> Expected:
        """Where it should be; there must be at least one frame."""
        ages = np.array(self._times, np.float64) - time
        states = np.array(self._states)
        weights = np.array(self._weights) * np.exp((ages - ages[-1]) / FADING)
        all_of_them = weights.sum()
        rows = np.column_stack([np.ones(len(ages)), ages])
        normal = (rows.T * weights) @ rows + np.diag([0.0, LEAST_VELOCITY * all_of_them])
        here = np.linalg.solve(normal, (rows.T * weights) @ states)[0]
        off_place, off_size = self._scatter()
        return Expected(here[:2], float(np.exp(weights @ states[:, 2] / all_of_them)), off_place, off_size)

    def _scatter(self) -> tuple[float, float]:
        if len(self._misses) < FIRST:
            return GUESS, GUESS
        squares = np.minimum(np.abs(np.array(self._misses)), LARGEST_MISS) ** 2
        x, y, size = squares.mean(axis=0)
        return float(np.sqrt(x + y)), float(np.sqrt(size))
