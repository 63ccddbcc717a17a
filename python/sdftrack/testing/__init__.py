# SPDX-License-Identifier: MIT
"""Helpers for testing programs that use this library; the pytest fixtures are in `fixtures`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sdftrack.metrics import pose_error

__all__ = ["assert_pose_close"]


def assert_pose_close(T: ArrayLike, T_ref: ArrayLike, atol_m: float, atol_rad: float) -> None:
    """Fail unless two poses (4, 4) are within `atol_m` metres and `atol_rad` radians of each other.

    Raises
    ------
    AssertionError
        States both distances; also raised for NaN.
    """
    __tracebackhide__ = True
    A, B = np.asarray(T, dtype=np.float64), np.asarray(T_ref, dtype=np.float64)
    if A.shape != (4, 4) or B.shape != (4, 4):
        raise AssertionError(f"expected poses of shape (4, 4), got {A.shape} and {B.shape}")
    metres, radians = pose_error(A, B)
    if not (metres <= atol_m and radians <= atol_rad):  # NaN fails too
        raise AssertionError(
            f"poses differ by {1e3 * metres:.4g} mm and {np.degrees(radians):.4g} deg, expected at most "
            f"{1e3 * atol_m:.4g} mm and {np.degrees(atol_rad):.4g} deg\n{A}\nagainst\n{B}"
        )
