# SPDX-License-Identifier: MIT
"""Curves of quaternions (x, y, z, w) in four dimensions: their rotations and angular velocities.

A smooth curve q(t) that is nearly of unit length stands for the rotations of q / |q|. Its angular velocity is exact for
any length: w = 2 vec(q' q*) / |q|^2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["angular_velocities", "continuous_quaternions", "exponentials", "left_jacobians", "matrices"]

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
    rows = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def exponentials(w: Array) -> Array:
    """(..., 3, 3) rotations of rotation vectors (..., 3)."""
    half = 0.5 * np.linalg.norm(w, axis=-1, keepdims=True)
    return matrices(np.concatenate([0.5 * w * np.sinc(half / np.pi), np.cos(half)], axis=-1))


def angular_velocities(q: Array, rate: Array) -> Array:
    """(..., 3) in the axes of the reference frame, rad/s, of curves q (..., 4) with derivative `rate` (..., 4)."""
    u, w = q[..., :3], q[..., 3:]
    du, dw = rate[..., :3], rate[..., 3:]
    vector = w * du - dw * u - np.cross(du, u)
    return np.asarray(2.0 * vector / (q**2).sum(axis=-1, keepdims=True))
