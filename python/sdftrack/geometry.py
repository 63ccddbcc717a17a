# SPDX-License-Identifier: MIT
"""Poses as (4, 4) float64 arrays: `T_a_b` maps a point in frame b to frame a, `p_a = T_a_b p_b`.

Transforms compose as `T_obj_cam = T_obj_world @ T_world_cam`. The camera looks along +z, with x to the right and y
down. Rotations are given by rotation vectors: axis times angle in radians.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.validation import numbers, shown

__all__ = ["exp", "inverse", "log", "look_at", "pose", "rigid", "transform_points"]

Array = NDArray[np.float64]
MOST = 1e100  # of a length: products of two are finite
MOST_RAD = 1e15  # beyond, a float64 does not tell one angle from the next


def rigid(T: ArrayLike, name: str = "T") -> Array:
    """`T` as a (4, 4) float64 rigid transform.

    A matrix whose deviation from a rotation, max |R^T R - I|, is at most 0.01 is projected to the nearest rotation,
    with a warning beyond 0.001; larger deviations raise ValueError.
    """
    return rigid_pose(T, name)


def pose(w_rad: ArrayLike = (0.0, 0.0, 0.0), t_m: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Transform with rotation vector `w_rad` and translation `t_m`."""
    w = _vector(w_rad, "w_rad")
    if not np.abs(w).max() <= MOST_RAD:
        raise ValueError(f"w_rad: expected at most {MOST_RAD:g} rad about each axis, got {w.tolist()}")
    T: Array = np.array(_core.rotation_exp(w.tolist()))
    T[:3, 3] = _vector(t_m, "t_m")
    return T


def exp(twist: ArrayLike) -> Array:
    """Exponential map of SE(3).

    Parameters
    ----------
    twist : (6,) array (v, w)
        Translational part in metres, then the rotation vector in radians, both per unit time.

    Examples
    --------
    >>> exp([0.1, 0, 0, 0, 0, 0])[:3, 3].tolist()
    [0.1, 0.0, 0.0]
    """
    x = numbers(twist, "twist")
    if x.shape != (6,):
        raise ValueError(f"twist: expected shape (6,) = (v, w), got {x.shape}")
    if not np.abs(x[:3]).max() <= MOST:
        raise ValueError(f"twist: expected finite numbers, at most {MOST:g} m, got {x.tolist()}")
    T = pose(x[3:])
    T[:3, 3] = _left_jacobian(x[3:]) @ x[:3]
    return T


def log(T: ArrayLike) -> Array:
    """The twist (v, w) with `exp(twist) = T` and |w| <= pi."""
    M = rigid(T)
    w = np.array(_core.rotation_log(M))
    return np.concatenate([np.linalg.solve(_left_jacobian(w), M[:3, 3]), w])


def inverse(T: ArrayLike) -> Array:
    """Inverse of rigid transforms (..., 4, 4)."""
    M = numbers(T, "T")
    if M.shape[-2:] != (4, 4):
        raise ValueError(f"T: expected shape (..., 4, 4), got {M.shape}")
    out = np.zeros_like(M)
    out[..., :3, :3] = np.swapaxes(M[..., :3, :3], -1, -2)
    out[..., :3, 3] = -(out[..., :3, :3] @ M[..., :3, 3:])[..., 0]
    out[..., 3, 3] = 1.0
    return out


def transform_points(T: ArrayLike, points: ArrayLike) -> Array:
    """Apply the pose `T` (4, 4) to points (..., 3)."""
    M, p = numbers(T, "T"), numbers(points, "points")
    if M.shape != (4, 4):
        raise ValueError(f"T: expected shape (4, 4), got {M.shape}")
    if p.ndim == 0 or p.shape[-1] != 3:
        raise ValueError(f"points: expected shape (..., 3), got {p.shape}")
    return p @ M[:3, :3].T + M[:3, 3]


def look_at(eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """T_cam_world of a camera at `eye` that looks at `target`, with `up` pointing up in the image (-y)."""
    e, t, u = _vector(eye, "eye"), _vector(target, "target"), _vector(up, "up")
    if not max(np.abs(e).max(), np.abs(t).max(), np.abs(u).max()) <= MOST:
        raise ValueError(f"eye, target, up: expected coordinates of at most {MOST:g}")
    z = t - e
    x = np.cross(z, u)
    if np.linalg.norm(z) == 0 or np.linalg.norm(x) < 1e-12 * np.linalg.norm(z) * np.linalg.norm(u):
        raise ValueError(
            f"up: expected a direction that is not along target - eye = {z.tolist()}, got {u.tolist()}"
        )
    z, x = z / np.linalg.norm(z), x / np.linalg.norm(x)
    T_world_cam = np.eye(4)
    T_world_cam[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    T_world_cam[:3, 3] = e
    return inverse(T_world_cam)


def _left_jacobian(w: Array) -> Array:
    a2 = float(w @ w)
    a = np.sqrt(a2)
    if a > 1e-3:
        b, c = (1 - np.cos(a)) / a2, (a - np.sin(a)) / (a2 * a)
    else:
        b, c = 0.5 - a2 / 24, 1 / 6 - a2 / 120
    K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return np.eye(3) + b * K + c * (K @ K)


def _vector(v: ArrayLike, name: str) -> Array:
    x = numbers(v, name)
    if x.shape != (3,) or not np.isfinite(x).all():
        raise ValueError(f"{name}: expected 3 finite numbers, got {shown(x)}")
    return x
