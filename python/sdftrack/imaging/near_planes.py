# SPDX-License-Identifier: MIT
"""Tables, walls and boards around a location in a depth image: planes larger than the object."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MIN_M, PER_M2 = 0.005, 0.005  # half thickness of a plane at distance z: MIN_M + PER_M2 z^2


class NearPlane(NamedTuple):
    """``normal . p + offset = 0``, the normal towards the camera; its pixels and their extent."""

    normal: Array
    offset: float
    pixels: Mask
    extent_m: float

    def height(self, points: Array) -> Array:
        """Height of points (..., 3) above the plane, on the camera's side."""
        return points @ self.normal + self.offset


def tolerance_m(z: Array) -> Array:
    """Tolerance for a measurement at distance z to belong to a plane."""
    return MIN_M + PER_M2 * z**2


def planes_near(points: Array, read: Mask, around: Mask, size_m: float) -> list[NearPlane]:
    """Planes among the pixels `around` with a connected extent larger than an object of `size_m`.

    `points` (H, W, 3) are in the camera's frame, m; `read` (H, W): which were measured.
    """
    found = _core.planes_near(np.ascontiguousarray(points), np.array(read), np.array(around), size_m)
    return [
        NearPlane(np.array(normal), offset, pixels, extent_m) for normal, offset, pixels, extent_m in found
    ]
