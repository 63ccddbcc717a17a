# SPDX-License-Identifier: MIT
"""Prediction of the location and size of a silhouette from the last frames."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.placement import Placement

__all__ = ["MotionPredictor", "Prediction"]

Array: TypeAlias = NDArray[np.float64]
HISTORY = 8  # frames that a prediction is made of
DECAY = 4.0  # frames after which the weight has fallen to 1 / e
MIN_VELOCITY = 0.1  # of the weights, added to the velocity's: a few frames do not determine a velocity
ERRORS = 60  # frames whose prediction errors are kept
MIN_ERRORS = 6  # errors, below which their rms is not measured yet
FIRST_ERROR = 0.02  # what is assumed until then
MAX_ERROR = 0.2  # of the size: one jump does not make all later ones likely


@dataclass(frozen=True)
class Prediction:
    """Predicted location and size in the image, and the rms prediction error relative to the size."""

    center_px: Array
    size_px: float
    place_error: float
    size_error: float


class MotionPredictor:
    """Weighted locations and sizes of the last frames: constant velocity and constant size."""

    def __init__(self) -> None:
        self._times: deque[int] = deque(maxlen=HISTORY)
        self._states: deque[Array] = deque(maxlen=HISTORY)
        self._weights: deque[float] = deque(maxlen=HISTORY)
        self._errors: deque[Array] = deque(maxlen=ERRORS)

    def __len__(self) -> int:
        return len(self._times)

    def add(self, time: int, placement: Placement, weight: float = 1.0) -> None:
        """Add a frame; a weight of 1 means that the whole silhouette was visible."""
        if weight >= 1 and len(self) >= MIN_ERRORS:
            there = self.predict(time)
            place = (placement.center_px - there.center_px) / there.size_px
            self._errors.append(np.array([*place, np.log(placement.size_px / there.size_px)]))
        self._times.append(time)
        self._states.append(np.array([*placement.center_px, np.log(placement.size_px)]))
        self._weights.append(weight)

    def forget(self) -> None:
        """Drop the locations; the errors of earlier predictions are kept."""
        for kept in (self._times, self._states, self._weights):
            kept.clear()

    def predict(self, time: int) -> Prediction:
        """The prediction for a frame; there must be at least one earlier frame."""
        ages = np.array(self._times, np.float64) - time
        states = np.array(self._states)
        weights = np.array(self._weights) * np.exp((ages - ages[-1]) / DECAY)
        total = weights.sum()
        rows = np.column_stack([np.ones(len(ages)), ages])
        normal = (rows.T * weights) @ rows + np.diag([0.0, MIN_VELOCITY * total])
        here = np.linalg.solve(normal, (rows.T * weights) @ states)[0]
        place_error, size_error = self._rms_errors()
        return Prediction(here[:2], float(np.exp(weights @ states[:, 2] / total)), place_error, size_error)

    def _rms_errors(self) -> tuple[float, float]:
        if len(self._errors) < MIN_ERRORS:
            return FIRST_ERROR, FIRST_ERROR
        squares = np.minimum(np.abs(np.array(self._errors)), MAX_ERROR) ** 2
        x, y, size = squares.mean(axis=0)
        return float(np.sqrt(x + y)), float(np.sqrt(size))
