# SPDX-License-Identifier: MIT
"""The outline term, line by line (docs/math/outline.md)."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def outline_residuals(lines: Array, K: Array, T_cam_obj: Array) -> Array:
    """Distance (px, outwards) of each line's point from where the colours put the outline; a pinhole.

    Rows of `lines`: X, Y, Z (m, object), centre (2) and normal (2) in the image, offset and sd (px).
    """
    p = lines[:, :3] @ T_cam_obj[:3, :3].T + T_cam_obj[:3, 3]
    u = p @ K.T
    u = u[:, :2] / u[:, 2:]
    off: Array = np.einsum("ij,ij->i", lines[:, 5:7], u - lines[:, 3:5]) - lines[:, 7]
    return off


def outline_cost(
    lines: Array, K: Array, T_cam_obj: Array, noise: float = 1.0, common_sd: float = 0.0, shared: float = 1.0
) -> float:
    """``min_b sum log(1 + r^2 / 2) + shared b^2 / (2 common_sd^2)``, r the residual less b over `noise` times the sd.

    b (px) is an offset that all lines have in common; none where `common_sd` is 0.
    """
    off, sd = outline_residuals(lines, K, T_cam_obj), noise * lines[:, 8]

    def cost(b: float) -> float:
        held = shared * b**2 / (2 * common_sd**2) if common_sd > 0 else 0.0
        return float(np.log1p(0.5 * ((off - b) / sd) ** 2).sum()) + held

    if not common_sd > 0:
        return cost(0)
    b = 0.0
    for _ in range(3000):  # reweighted squares, which go downhill in every step
        weight = 1 / (sd**2 * (1 + 0.5 * ((off - b) / sd) ** 2))
        b = float(weight @ off / (weight.sum() + shared / common_sd**2))
    return cost(b)
