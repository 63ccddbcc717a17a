# SPDX-License-Identifier: MIT
"""A lens and what an object says of it, in plain numpy: the twin of cpp/calibration.

The lens parameters are fx, fy, cx, cy, skew, k1, k2, depth scale, depth offset (m). A measurement d at pixel (u, v) is
the point ``(scale d + offset) ray(u, v)``. Derivation: docs/math/intrinsics.md.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.energies import GRAZING_SLOPE, HIT_LEAD_M
from reference.sdf import sample

Array = NDArray[Any]

CONVERGED_M = 1e-10


def ray_of(lens: Array, u_px: float, v_px: float) -> Array:
    """(3,) ray of a pixel, z = 1; the distortion undone by repetition until nothing changes."""
    fx, fy, cx, cy, skew, k1, k2 = lens[:7]
    y = (v_px - cy) / fy
    x = (u_px - cx - skew * y) / fx
    ideal = np.array([x, y])
    for _ in range(200):
        r2 = ideal @ ideal
        ideal = np.array([x, y]) / (1 + k1 * r2 + k2 * r2 * r2)
    return np.array([ideal[0], ideal[1], 1.0])


def depth_of(lens: Array, reading_m: float) -> float:
    """Depth (m) of a measurement."""
    return float(lens[7] * reading_m + lens[8])


def residual(
    volume: tuple[Array, float, Array],
    lens: Array,
    T_obj_cam: Array,
    u_px: float,
    v_px: float,
    reading_m: float,
) -> float:
    """Depth at which the ray meets the surface, minus measured depth (m), by Newton's method from the latter."""
    values, voxel_m, origin = volume
    ray, depth = ray_of(lens, u_px, v_px), depth_of(lens, reading_m)
    R, t = T_obj_cam[:3, :3], T_obj_cam[:3, 3]
    z = depth - HIT_LEAD_M
    for _ in range(60):
        phi, gradient = sample(values, voxel_m, origin, R @ (z * ray) + t)
        z -= phi / min(float(gradient @ (R @ ray)), -GRAZING_SLOPE)
        if abs(phi) < CONVERGED_M:
            break
    return float(z - depth)


def point_residual(
    volume: tuple[Array, float, Array],
    lens: Array,
    T_obj_cam: Array,
    u_px: float,
    v_px: float,
    reading_m: float,
) -> float:
    """phi at the measured point, in metres of the measurement: the thesis' residual (thesis Eq. 3.11)."""
    values, voxel_m, origin = volume
    point = depth_of(lens, reading_m) * ray_of(lens, u_px, v_px)
    phi, _ = sample(values, voxel_m, origin, T_obj_cam[:3, :3] @ point + T_obj_cam[:3, 3])
    return float(phi / lens[7])


def numeric_rows(function: Callable[[Array], float], at: Array, steps: Array) -> Array:
    """Derivatives of `function` by each number of `at`, by central differences."""
    rows = []
    for j, step in enumerate(steps):
        d = np.zeros(len(at))
        d[j] = step
        rows.append((function(at + d) - function(at - d)) / (2 * step))
    return np.array(rows)


def marginal_information(hessian: Array, unknowns_of_pose: int = 6) -> Array:
    """Inverse of the covariance of what comes after the pose, the pose being unknown: (Hkk - Hkp Hpp^-1 Hpk)."""
    n = unknowns_of_pose
    covariance = np.linalg.inv(hessian)
    return np.linalg.inv(covariance[n:, n:])
