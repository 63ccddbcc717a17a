# SPDX-License-Identifier: MIT
"""Placement of a silhouette in an image, between the memory's frame and the tracker's grid, and its prediction.

The tracker's grid follows the bounding box of the visible part in jumps, but a memory requires equal shapes at equal
locations. Its frame is therefore centred at the silhouette's centroid, has a fixed area (as in `st.contour.align`), and
rotates with the tracker.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.masks import FILL

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Picture: TypeAlias = NDArray[np.float32]


@dataclass(frozen=True)
class Placement:
    """A frame of silhouettes in the image.

    Attributes
    ----------
    center_px : (2,) float64
        Centroid of the silhouette, (x, y) in the image.
    size_px : float
        Square root of its area, pixels.
    turn : (2, 2) float64
        Maps the frame's axes to those of the image, determinant 1: a rotation, with shear if the tracker has shear.
    """

    center_px: Array
    size_px: float
    turn: Array

    def to_image(self, size: int) -> Array:
        """(3, 3): maps pixel (x, y, 1) of the `size` x `size` frame to the image."""
        linear = self.size_px / (FILL * size) * self.turn
        middle = (size - 1) / 2
        return np.vstack([np.column_stack([linear, self.center_px - linear.sum(axis=1) * middle]), [0, 0, 1]])

    def moved(self, x: float, y: float, log_scale: float, angle_rad: float, size: int) -> Placement:
        """Translated by x, y pixels of the frame, then scaled and rotated."""
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        center = self.center_px + self.size_px / (FILL * size) * (self.turn @ [x, y])
        return Placement(
            center, self.size_px * float(np.exp(log_scale)), self.turn @ np.array([[c, -s], [s, c]])
        )


def placement_of(mask: Mask, warp: Array) -> Placement:
    """Placement from centroid and area of a mask on a grid that `warp` (3, 3) maps to the image; must not be empty."""
    rows, columns = mask.sum(axis=1, dtype=np.float64), mask.sum(axis=0, dtype=np.float64)
    cells = rows.sum()
    middle = np.array([columns @ np.arange(len(columns)), rows @ np.arange(len(rows)), cells]) / cells
    per_cell = abs(np.linalg.det(warp[:2, :2]))
    return Placement((warp @ middle)[:2], float(np.sqrt(cells * per_cell)), warp[:2, :2] / np.sqrt(per_cell))


def seen_from(picture: Picture, warp: Array, placement: Placement, size: int, margin: int = 0) -> Picture:
    """Resample an image on the tracker's grid to a placement's frame, by area when shrinking.

    (size + 2 margin, size + 2 margin) float32, 0 beyond the grid.
    """
    import cv2

    to_cells = np.linalg.inv(warp) @ placement.to_image(size)
    cells = float(np.sqrt(abs(np.linalg.det(to_cells[:2, :2]))))  # per pixel of the frame
    if cells > 1:
        mean_over = 2 * int(cells / 2) + 1  # odd, so that nothing moves
        picture = np.asarray(cv2.blur(picture, (mean_over, mean_over)), np.float32)
    shift = np.array([[1, 0, -margin], [0, 1, -margin], [0, 0, 1]])
    n = size + 2 * margin
    image = cv2.warpAffine(
        picture, (to_cells @ shift)[:2], (n, n), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return np.asarray(image, np.float32)


def put_back(mask: Mask, warp: Array, placement: Placement, shape: tuple[int, int]) -> Mask:
    """Resample a mask of a placement's frame to the tracker's grid of `shape` cells."""
    import cv2

    to_frame = np.linalg.inv(placement.to_image(mask.shape[0])) @ warp
    image = cv2.warpAffine(
        mask.astype(np.float32),
        to_frame[:2],
        (shape[1], shape[0]),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
    )
    return np.asarray(image > 0.5)


# -- Prediction of the location and size of a silhouette from the last frames


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
