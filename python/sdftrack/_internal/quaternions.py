# SPDX-License-Identifier: MIT
"""Unit quaternions (x, y, z, w) and rotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["quaternion", "rotation"]

Array = NDArray[np.float64]


def quaternion(R: ArrayLike) -> Array:
    """(x, y, z, w) of a (3, 3) rotation, w >= 0 (Bar-Itzhack: the dominant eigenvector, good for any angle)."""
    R = np.asarray(R, np.float64)
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
            [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
            [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]],
        ]
    )
    q: Array = np.linalg.eigh(K)[1][:, -1]  # reads the lower triangle
    return q if q[3] >= 0 else -q


def rotation(q: ArrayLike) -> Array:
    """(3, 3) rotation of a quaternion (x, y, z, w) of any length but 0."""
    x, y, z, w = np.asarray(q, dtype=np.float64)
    with np.errstate(over="ignore"):  # refused below
        n = x * x + y * y + z * z + w * w
    if not (np.isfinite(n) and n > 0):
        raise ValueError(
            f"q: expected a quaternion (x, y, z, w) that is finite and not 0, got {[float(v) for v in (x, y, z, w)]}"
        )
    s = 2 / n
    return np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )
