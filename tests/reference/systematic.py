# SPDX-License-Identifier: MIT
"""What a smooth error of the depth does to a pose, in plain numpy: the twin of cpp/tracking/trust/systematic."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.energies import DepthLogistic, Field, find_hit

Array = NDArray[Any]

SHARES = np.array([1.0, 0.5, 0.5, 0.2, 0.2, 0.2])  # sd of each mode over systematic_m
PATCH_SHARE, LATERAL_SHARE = 0.25, 0.4
PATCHES = 16
GRAZING = 0.17
UNIT_SQUARE = 1.118  # 1 / rms of x^2 - 1, x uniform of variance 1


def modes(u: Array, v: Array) -> Array:
    """(N, 6) at pixels (N,): 1, x, y, x^2 - 1, x y, y^2 - 1, with x and y of mean 0 and variance 1 over the pixels."""
    x, y = ((p - p.mean()) / max(1.0, p.std()) for p in (u, v))
    square = UNIT_SQUARE * np.array([x**2 - 1, y**2 - 1])
    return np.stack([np.ones_like(x), x, y, square[0], x * y, square[1]], axis=1)


def bias_response(
    field: Field,
    uv: Array,
    rays: Array,
    depths: Array,
    gains: Array,
    penalty: DepthLogistic,
    information: Array,
    diameter: float,
) -> tuple[Array, Array]:
    """Shifts (6, 6) of the increment per metre of each mode, and its covariance by patches of one metre.

    information : (6, 6) that the pixels give the pose (`Sums.A`). It counts each by the mean of psi', the sums here by
    psi / residual: these are made as large as it, so that an error that a pose explains moves the pose by just that.
    No direction is blind.
    """
    m = modes(*uv[gains == 0].T)
    pulls, squares, here, used = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)), 0
    for k, i in enumerate(np.nonzero(gains == 0)[0]):
        z, slope, J_phi, _ = find_hit(field, rays[i], float(depths[i]))
        if abs(slope) <= GRAZING:
            continue
        residual = z - depths[i]
        weight = penalty(residual).slope / residual if residual else 1 / (2 * penalty.scale_m**2)
        J = -J_phi / slope
        pulls += weight * np.outer(J, m[k])
        here += weight * np.outer(J, J)
        squares += weight**2 * np.outer(J, J)
        used += 1
    unit = np.array([1, 1, 1, *[4 / diameter**2] * 3])
    scale = (unit @ np.diag(information)) / (unit @ np.diag(here))
    prior = np.diag([diameter**-2] * 3 + [np.pi**-2] * 3)
    R = scale * np.linalg.inv(information + prior)
    return R @ pulls, R @ (used / PATCHES * squares) @ R.T
