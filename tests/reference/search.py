# SPDX-License-Identifier: MIT
"""The pieces of a search without a first pose in plain numpy: the twin of cpp/tracking/{so3_grid,search_score}."""

from __future__ import annotations

from math import cos, gcd, pi, sin, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["explained_share", "score_of_mask", "score_of_place", "seed_rotation", "super_fibonacci"]

Array = NDArray[Any]

STRIDE = 0.471  # of the spiral: runs of 60 of 240 leave gaps below 57 degrees
MIN_AGREEING = 6  # surface points; fewer say nothing
ENOUGH_SEEN = 0.8  # share of the visible surface that must be read for a full score
ENOUGH_ENDS = 0.4  # share of the outline that must end in a step of depth


def super_fibonacci(i: int, n: int) -> Array:
    """Rotation i of n of the super-Fibonacci spiral (Alexa, CVPR 2022), (3, 3)."""
    psi = 1.533751168755204288118041  # psi^4 = psi + 4
    s = i + 0.5
    r, R = sqrt(s / n), sqrt(1 - s / n)
    a, b = 2 * pi * s / sqrt(2), 2 * pi * s / psi
    w, x, y, z = R * cos(b), r * sin(a), r * cos(a), R * sin(b)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def seed_rotation(k: int, n: int) -> Array:
    """The same rotations in an order whose every run of consecutive ones is spread over all of SO(3)."""
    stride = max(1, int(STRIDE * n))
    while gcd(stride, n) != 1:
        stride -= 1
    return super_fibonacci(k * stride % n, n)


def explained_share(phi: Array, slope: Array, tolerance_m: float) -> float:
    """Share of measurements that lie on a surface facing the camera: phi (N,) m, d phi / d depth (N,)."""
    return float(np.mean((np.abs(phi) < tolerance_m) & (slope < 0)))


def _unhidden(agree: int, farther: int) -> float:
    return agree / (agree + farther) if agree >= MIN_AGREEING else 0.0


def score_of_mask(agree: int, farther: int, explained: float) -> float:
    """Of the surface that nothing hides, the share read where it should be, times what is explained of the mask."""
    return _unhidden(agree, farther) * explained


def score_of_place(agree: int, farther: int, nearer: int, ends: int, runs_on: int) -> float:
    """Without a mask the object must end where it should, too, and enough of it must be seen."""
    read = agree / max(1, agree + farther + nearer)
    outline = ends / (ends + runs_on) if ends + runs_on else 1.0
    seen = sqrt(min(1.0, read / ENOUGH_SEEN))
    return _unhidden(agree, farther) * seen * min(1.0, outline / ENOUGH_ENDS)
