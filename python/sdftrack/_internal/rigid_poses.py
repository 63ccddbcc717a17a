# SPDX-License-Identifier: MIT
"""Poses given by users and data sets: projected to rigid transforms, with a warning if the change is noticeable."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.validation import numbers

__all__ = ["RotationErrors", "rigid_pose"]

SILENT = 1e-3  # of max |R^T R - I|: rounding in a text file; the core refuses 0.01 and more


class RotationErrors:
    """Deviations of many poses from rotations, reported in one warning."""

    def __init__(self) -> None:
        self.count, self.worst, self.first = 0, 0.0, ""

    def add(self, error: float, name: str) -> None:
        """Record a deviation of `error` from a rotation."""
        if error <= SILENT:
            return
        self.count += 1
        self.first = self.first or name
        self.worst = max(self.worst, error)

    def tell(self, stacklevel: int = 3) -> None:
        """Issue the warning, if any."""
        if not self.count:
            return
        one = self.count == 1
        which = self.first if one else f"{self.count} poses, the first of them {self.first}"
        warnings.warn(
            f"{which}: R^T R differs from I by {'' if one else 'up to '}{self.worst:.2g}; replaced by the nearest "
            "rotation" + ("" if one else "s"),
            stacklevel=stacklevel,
        )


def rigid_pose(
    T: Any, name: str, errors: RotationErrors | None = None, stacklevel: int = 3
) -> NDArray[np.float64]:
    """`T` as a (4, 4) float64 rigid transform, with the nearest rotation.

    max |R^T R - I| may be up to 0.01; beyond 0.001 a warning is issued, or with `errors` recorded there.

    Raises
    ------
    TypeError, ValueError
        Not a (4, 4) float64 array, not finite, no rotation to within 0.01.
    """
    M = numbers(T, name)
    result: NDArray[np.float64] = _core.nearest_rigid(M, name)
    own = RotationErrors() if errors is None else errors
    R = M[:3, :3]
    own.add(float(np.abs(R.T @ R - np.eye(3)).max()), name)
    if errors is None:
        own.tell(stacklevel + 1)
    return result
