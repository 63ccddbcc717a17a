# SPDX-License-Identifier: MIT
"""Rotations as quaternions, and poses given by users and data sets, projected to rigid transforms."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import numbers

Array = NDArray[np.float64]

SILENT = 1e-3  # of max |R^T R - I|: rounding in a text file; the core refuses 0.01 and more


class RotationErrors:
    """Deviations of many poses from rotations, reported in one warning."""

    def __init__(self) -> None:
        self.count, self.worst, self.first = 0, 0.0, ""

    def add(self, error: float, name: str) -> None:
        if error <= SILENT:
            return
        self.count += 1
        self.first = self.first or name
        self.worst = max(self.worst, error)

    def tell(self, stacklevel: int = 3) -> None:
        if not self.count:
            return
        one = self.count == 1
        which = self.first if one else f"{self.count} poses, the first of them {self.first}"
        warnings.warn(
            f"{which}: R^T R differs from I by {'' if one else 'up to '}{self.worst:.2g}; replaced by the nearest "
            "rotation" + ("" if one else "s"),
            stacklevel=stacklevel,
        )


def rigid_pose(T: Any, name: str, errors: RotationErrors | None = None, stacklevel: int = 3) -> Array:
    """`T` as a (4, 4) float64 rigid transform, with the nearest rotation.

    max |R^T R - I| may be up to 0.01; beyond 0.001 a warning is issued, or with `errors` recorded there.

    Raises
    ------
    TypeError, ValueError
        Not a (4, 4) float64 array, not finite, no rotation to within 0.01.
    """
    M = numbers(T, name)
    result: Array = _core.nearest_rigid(M, name)
    own = RotationErrors() if errors is None else errors
    R = M[:3, :3]
    own.add(float(np.abs(R.T @ R - np.eye(3)).max()), name)
    if errors is None:
        own.tell(stacklevel + 1)
    return result


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
