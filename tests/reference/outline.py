# SPDX-License-Identifier: MIT
"""The outline term, line by line (docs/math/outline.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PER_SIDE, PSEUDO_PIXELS, LOCAL_BINS = 4, 15, 512


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


def local_color_chances(
    whole: tuple[Array, Array],
    points: Array,
    is_object: NDArray[np.bool_],
    bins: NDArray[np.int_],
    frames: NDArray[np.int_],
    rate: float,
    asked: Array,
    asked_bins: NDArray[np.int_],
) -> Array:
    """Chance that a colour at a place of the object is the object's, from pixels seen on both sides of its outline.

    `whole`: densities of the whole object's and background's histograms over 16 x 16 x 16 colours, times 4096.
    Of a place that frames see again, what was seen before counts ``1 - rate`` as much.
    """

    def place(p: Array) -> tuple[int, ...]:
        axis = int(np.argmax(np.abs(p)))
        cells = np.floor((np.delete(p, axis) / abs(p[axis]) + 1) / 2 * PER_SIDE)
        return (axis, int(p[axis] > 0), *np.clip(cells, 0, PER_SIDE - 1).astype(int))

    def coarse(color: int) -> int:
        r, g, b = color // 256, color // 16 % 16, color % 16
        return int((r // 2 * 8 + g // 2) * 8 + b // 2)

    def density(side: int, p: Array, color: int) -> float:
        """Of the pixels of this place and side, weighed by how many later frames have seen the place."""
        count, colored = 0.0, 0.0
        here = [i for i in range(len(points)) if place(points[i]) == place(p)]
        met = sorted({int(frames[i]) for i in here})
        for i in here:
            weight = (1 - rate) ** (len(met) - 1 - met.index(int(frames[i])))
            if bool(is_object[i]) == (side == 0):
                count += weight
                colored += weight * (coarse(int(bins[i])) == coarse(color))
        return (LOCAL_BINS * colored + PSEUDO_PIXELS * float(whole[side][color])) / (count + PSEUDO_PIXELS)

    chances = []
    for p, color in zip(asked, asked_bins, strict=True):
        f, b = density(0, p, int(color)), density(1, p, int(color))
        chances.append(f / (f + b))
    return np.array(chances)
