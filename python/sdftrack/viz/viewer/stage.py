# SPDX-License-Identifier: MIT
"""Where things stand in the page's 3-D view: the scene in the camera's frame, the image on a board beside it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Board", "initial_view", "place_board", "scene_distance"]

GAP = 0.06  # between the board and the scene, in widths of the board
FOV_RAD = math.radians(50)  # vertical, of the page's view
ASPECT = 1.3  # of the part of a page that shows the scene; a narrower one needs the mouse wheel
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Board:
    """The camera image as a rectangle that faces the camera, left of what the camera sees.

    Attributes
    ----------
    center : (3,)
        Camera frame, m.
    width_m, height_m : float
    width_px, height_px : int
        Size of the depth image.
    """

    center: tuple[float, float, float]
    width_m: float
    height_m: float
    width_px: int
    height_px: int

    def pixel(self, origin: Any, through: Any) -> tuple[float, float] | None:
        """Pixel (x, y) that a ray from `origin` through a point meets; None: it misses the board's plane.

        Pixels beyond the board's border are returned as they are.
        """
        a, b = np.asarray(origin, np.float64), np.asarray(through, np.float64)
        step = b - a
        if abs(step[2]) < 1e-12:
            return None
        share = (self.center[2] - a[2]) / step[2]
        if share <= 0:
            return None
        hit = a + share * step - np.asarray(self.center)
        x = (hit[0] / self.width_m + 0.5) * self.width_px - 0.5
        y = (hit[1] / self.height_m + 0.5) * self.height_px - 0.5
        return float(x), float(y)

    def point(self, x_px: float, y_px: float, lift_m: float = 0.0) -> Array:
        """Point (3,) of a pixel, `lift_m` in front of the board; camera frame, m."""
        return np.array(
            [
                self.center[0] + ((x_px + 0.5) / self.width_px - 0.5) * self.width_m,
                self.center[1] + ((y_px + 0.5) / self.height_px - 0.5) * self.height_m,
                self.center[2] - lift_m,
            ]
        )

    def contains(self, x_px: float, y_px: float) -> bool:
        return -0.5 <= x_px < self.width_px - 0.5 and -0.5 <= y_px < self.height_px - 0.5


def scene_distance(depth: NDArray[np.float32] | None, poses: Array | None) -> float | None:
    """Distance (m) of what matters: the tracked objects, else the median of the depth; None: nothing is known."""
    if poses is not None:
        z = poses[:, 2, 3]
        z = z[np.isfinite(z) & (z > 0)]
        if z.size:
            return float(np.median(z))
    if depth is not None:
        sample = depth[::8, ::8]
        sample = sample[sample > 0]
        if sample.size:
            return float(np.median(sample))
    return None


def place_board(lens: Any, distance_m: float) -> Board:
    """A board as large as what the camera sees at this distance. `lens`: the depth camera."""
    width, height = int(lens.width), int(lens.height)
    width_m = distance_m * width / float(lens.K[0, 0])
    return Board((-(1 + GAP) * width_m, 0.0, distance_m), width_m, width_m * height / width, width, height)


def initial_view(board: Board) -> tuple[Array, Array]:
    """Position and look-at point (m, camera frame) of a view of board and scene."""
    middle = np.array([-(1 + GAP) * board.width_m / 2, 0.0, board.center[2]])
    wide = (2 + 3 * GAP) * board.width_m / (2 * math.tan(FOV_RAD / 2) * ASPECT)
    high = 1.1 * board.height_m / (2 * math.tan(FOV_RAD / 2))
    return middle - [0.0, 0.0, max(wide, high)], middle
