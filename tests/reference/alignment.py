# SPDX-License-Identifier: MIT
"""The slow, obvious twin of `sdftrack.contour.alignment`: one silhouette at one place, pixel by pixel."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.alignment import AREA, EDGE_PX, FRAME, LACKING, MARGIN_PX

Array: TypeAlias = NDArray[np.float64]


def silhouette_cost(
    evidence: Array, phi: Array, move: tuple[float, float, float, float], block: int = 1
) -> float:
    """What a silhouette costs at a place, without priors (docs/shape_memory.md, "In a video").

    Parameters
    ----------
    evidence : (n, n, 2) float
        For and against the object, on the frame and MARGIN_PX pixels around it.
    phi : (FRAME, FRAME) float
        Distances of the silhouette, pixels, negative inside.
    move : (x, y, log scale, angle)
        Of the silhouette's frame: pixels, and radians.
    block : int
        Pixels of a side over which both are averaged first.
    """
    x0, y0, log_scale, angle = move
    c, s = np.exp(log_scale) * np.cos(angle), np.exp(log_scale) * np.sin(angle)
    middle = (FRAME - 1) / 2
    seen = np.zeros((FRAME, FRAME, 2))
    for row in range(FRAME):
        for column in range(FRAME):
            x, y = column - middle, row - middle
            u = c * x - s * y + x0 + middle + MARGIN_PX
            v = s * x + c * y + y0 + middle + MARGIN_PX
            seen[row, column] = _bilinear(evidence, u, v)
    soft = np.clip(phi / EDGE_PX, -1, 1)
    inside, outside = np.maximum(-soft, 0), np.maximum(soft, 0)
    total = 0.0
    for row in range(0, FRAME, block):
        for column in range(0, FRAME, block):
            part = slice(row, row + block), slice(column, column + block)
            pro, con = seen[part][..., 0].mean(), seen[part][..., 1].mean()
            total += -pro * (1 - outside[part].mean()) + LACKING * con * inside[part].mean()
    return float(1 + total * block**2 * np.exp(2 * log_scale) / AREA)


def _bilinear(image: Array, u: float, v: float) -> Array:
    x, y = int(np.floor(u)), int(np.floor(v))
    fx, fy = u - x, v - y
    top = (1 - fx) * image[y, x] + fx * image[y, x + 1]
    bottom = (1 - fx) * image[y + 1, x] + fx * image[y + 1, x + 1]
    return np.asarray((1 - fy) * top + fy * bottom)
