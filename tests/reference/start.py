# SPDX-License-Identifier: MIT
"""Regions of a start, in numpy: what hangs together around a pixel."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Array = NDArray[np.float64]

STEP, STEP_PX = 0.008, 3.0  # an edge: a step in depth, of the depth and of a pixel's width there
AROUND = 2.5  # times the object's size: the surroundings that planes are looked for in


def _neighbours(image: NDArray, y: int, x: int, outside: float) -> NDArray:
    """Each pixel's neighbour so many rows and columns away."""
    padded = np.pad(image, 1, constant_values=outside)
    return padded[1 + y : 1 + y + image.shape[0], 1 + x : 1 + x + image.shape[1]]


def joined(depth: NDArray[np.float32], free: Mask, seed: tuple[int, int], step_m: float) -> Mask:
    """Pixels of `free` connected to `seed`, (row, column), over the 8 neighbours by steps of at most `step_m`."""
    on = np.zeros(free.shape, bool)
    on[seed] = free[seed]
    while True:
        before = on.copy()
        for y in (-1, 0, 1):
            for x in (-1, 0, 1):
                near = np.abs(depth - _neighbours(depth, y, x, np.inf)) <= np.float32(step_m)
                on = on | (free & near & _neighbours(before, y, x, False).astype(bool))
        if (on == before).all():
            return on


def window(camera: Any, z: float, seed: tuple[int, int], reach_m: float) -> tuple[slice, slice]:
    """Rows and columns that contain everything within `reach_m` of the seed, at depth z."""
    far = reach_m / max(z - 0.5 * reach_m, 0.5 * z)
    rows, columns = int(far * camera.fy) + 1, int(far * camera.fx) + 1
    return (
        slice(max(0, seed[0] - rows), min(camera.height, seed[0] + rows + 1)),
        slice(max(0, seed[1] - columns), min(camera.width, seed[1] + columns + 1)),
    )
