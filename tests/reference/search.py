# SPDX-License-Identifier: MIT
"""The rotations of a search without a first pose in plain numpy: the twin of cpp/tracking/search/so3_grid."""

from __future__ import annotations

from math import cos, gcd, pi, sin, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

STRIDE = 0.471  # of the spiral: runs of 60 of 240 leave gaps below 57 degrees


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
