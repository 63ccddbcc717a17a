# SPDX-License-Identifier: MIT
"""Curves of quaternions (x, y, z, w) in four dimensions: their rotations and angular velocities.

A smooth curve q(t) that is nearly of unit length stands for the rotations of q / |q|. Its angular velocity is exact for
any length: w = 2 vec(q' q*) / |q|^2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def continuous_quaternions(R: Array) -> Array:
    """(n, 4) unit quaternions of rotations (n, 3, 3), of the sign that is nearer to the one before."""
    from scipy.spatial.transform import Rotation

    q = np.asarray(Rotation.from_matrix(R).as_quat())
    flips = np.sign(np.einsum("ni,ni->n", q[1:], q[:-1]))
    q[1:] *= np.cumprod(np.where(flips < 0, -1.0, 1.0))[:, None]
    return q


def left_jacobians(q: Array) -> Array:
    """(n, 4, 3): change of q by a small rotation r on the left, R -> Exp(r) R."""
    x, y, z, w = q.T
    G = np.array([[w, z, -y], [-z, w, x], [y, -x, w], [-x, -y, -z]])
    return np.asarray(0.5 * np.moveaxis(G, 2, 0))


def matrices(q: Array) -> Array:
    """(..., 3, 3) rotations of quaternions (..., 4) of any length but 0."""
    x, y, z, w = np.moveaxis(q, -1, 0)
    s = 2.0 / (x * x + y * y + z * z + w * w)
    out = np.empty((3, 3, *x.shape))
    xs, ys, zs = s * x, s * y, s * z
    out[0, 0], out[0, 1], out[0, 2] = 1 - (ys * y + zs * z), xs * y - zs * w, xs * z + ys * w
    out[1, 0], out[1, 1], out[1, 2] = xs * y + zs * w, 1 - (xs * x + zs * z), ys * z - xs * w
    out[2, 0], out[2, 1], out[2, 2] = xs * z - ys * w, ys * z + xs * w, 1 - (xs * x + ys * y)
    return np.moveaxis(out, (0, 1), (-2, -1))


def product_first(p: Array, q: Array) -> Array:
    """(4, ...) product p q of quaternions (4, ...): the rotation of q, then that of p."""
    return np.concatenate(
        [
            p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3], axis=0),
            [p[3] * q[3] - (p[:3] * q[:3]).sum(axis=0)],
        ]
    )


def exponentials_first(w: Array) -> Array:
    """(4, ...) quaternions of rotation vectors (3, ...)."""
    half = 0.5 * np.sqrt((w**2).sum(axis=0))
    return np.concatenate([0.5 * w * np.sinc(half / np.pi), [np.cos(half)]])


def angles_between(R: Array, S: Array) -> Array:
    """(...) angles of the rotations R^T S of two (..., 3, 3), rad: arccos((trace - 1) / 2)."""
    trace = np.einsum("...ij,...ij->...", R, S)
    return np.asarray(np.arccos(np.clip(0.5 * (trace - 1), -1, 1)))
