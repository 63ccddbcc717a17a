# SPDX-License-Identifier: MIT
"""The trilinear interpolant of a volume, point by point. Slow and obvious."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def sample(values: Array, voxel_size: float, origin: Array, point: Array) -> tuple[float, Array]:
    """phi and gradient of the trilinear interpolant at one point, continued outside the box as |p - q|."""
    x = (np.asarray(point) - origin) / voxel_size
    n = np.array(values.shape[::-1])
    q = np.clip(x, 0, n - 1)
    cell = np.minimum(q.astype(int), n - 2)
    f = q - cell
    phi, gradient = 0.0, np.zeros(3)
    for corner in np.ndindex(2, 2, 2):
        c = np.array(corner)
        weights = np.where(c == 1, f, 1 - f)
        value = float(values[tuple((cell + c)[::-1])])
        phi += value * weights.prod()
        for axis in range(3):
            others = np.delete(weights, axis).prod()
            gradient[axis] += value * others * (1 if c[axis] else -1) / voxel_size
    beyond = x - q
    length = float(np.linalg.norm(beyond))
    if length > 0:
        phi += voxel_size * length
        gradient = np.where(beyond != 0, beyond / length, gradient)
    return phi, gradient
