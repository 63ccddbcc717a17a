# SPDX-License-Identifier: MIT
"""What a pose costs, in plain numpy: the twin of cpp/energies, one pixel after the other.

A pixel with ray r (z = 1) and depth z is the point ``p = T_obj_cam (z r)``; phi and its gradient g at p give the
row ``J = d phi / d (v, w) = (g, (p - pivot) x g)`` of the update ``T_obj_cam <- T(v, w) T_obj_cam`` about `pivot`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.reference.sdf import sample

Array = NDArray[Any]

GRAZING_SLOPE = 0.17  # d phi / d z along a ray at 80 degrees from the normal
FALLBACK_SLOPE = 0.3  # least slope that a pixel without a hit is divided by
HIT_TOLERANCE_M = 5e-4
CONVERGED_M = 1e-5
NEWTON_STEPS = 8


def logistic(residual: float, s: float, outlier_floor: float = 0.0) -> tuple[float, float, float]:
    """Cost ``-log((1 - e) sech^2(r / 2s) + e)``, its slope, and the IRLS weight slope / r (limit at 0)."""
    u = residual / (2 * s)
    sech2 = 1 / np.cosh(u) ** 2
    likelihood = (1 - outlier_floor) * sech2 + outlier_floor
    inlier = (1 - outlier_floor) * sech2 / likelihood
    slope = inlier * np.tanh(u) / s
    weight = slope / residual if abs(u) > 1e-3 else inlier / (2 * s * s)
    return float(-np.log(likelihood)), float(slope), float(weight)


@dataclass(frozen=True)
class Pose:
    """An object's field and where it is: phi, g and J at points of the camera's frame."""

    values: Array
    voxel_size: float
    origin: Array
    T_obj_cam: Array
    pivot: Array

    def look(self, p_cam: Array) -> tuple[float, Array, Array]:
        """Phi (m), d phi / d p_cam and J at a point of the camera's frame."""
        R, t = self.T_obj_cam[:3, :3], self.T_obj_cam[:3, 3]
        p = R @ p_cam + t
        phi, g = sample(self.values, self.voxel_size, self.origin, p)
        return phi, R.T @ g, np.concatenate([g, np.cross(p - self.pivot, g)])


def ray_hit(
    pose: Pose, ray: Array, depth: float, steps: int = NEWTON_STEPS
) -> tuple[float, float, Array, float]:
    """Newton's iteration for the depth at which the ray meets the model, from the measured depth.

    Returns the depth, and of the last sample: the slope c along the ray (at most -GRAZING_SLOPE), J and phi.
    """
    z, c, phi, J = depth, 0.0, 0.0, np.zeros(6)
    for _ in range(steps):
        phi, g, J = pose.look(z * ray)
        c = min(float(g @ ray), -GRAZING_SLOPE)
        z -= phi / c
        if abs(phi) < CONVERGED_M:
            break
    return z, c, J, phi


def meets(pose: Pose, ray: Array, depth: float) -> bool:
    """Whether a pixel's ray hits the model: phi vanishes along it, and not at a grazing angle."""
    _, c, _, phi = ray_hit(pose, ray, depth)
    return abs(phi) < HIT_TOLERANCE_M and c < -GRAZING_SLOPE


def fallback_gain(pose: Pose, ray: Array, depth: float) -> float:
    """1 / slope of phi along the ray at the measured point, bounded."""
    _, g, _ = pose.look(depth * ray)
    return 1 / max(abs(float(g @ ray)), FALLBACK_SLOPE)


def read(pose: Pose, ray: Array, depth: float, gain: float) -> tuple[float, Array]:
    """Residual (m) of one pixel and its row.

    `gain` is the pixel's class: 0, its ray meets the model (residual: depth of the hit minus the measured depth);
    else what phi at the measured point is multiplied by (1: the residual as printed, Eq. 3.11).
    """
    if gain == 0:
        z, c, J, _ = ray_hit(pose, ray, depth)
        return z - depth, -J / c
    phi, _, J = pose.look(depth * ray)
    return gain * phi, gain * J


def linearize(
    pose: Pose,
    rays: Array,
    depths: Array,
    gains: Array,
    s: float,
    outlier_floor: float,
    curvature: str = "irls",
) -> tuple[float, Array, Array]:
    """Cost, gradient and Hessian: the sum over pixels (rays (N, 3) with z = 1, depths (N,) m, gains (N,))."""
    cost, gradient, hessian = 0.0, np.zeros(6), np.zeros((6, 6))
    for ray, depth, gain in zip(rays, depths, gains, strict=True):
        residual, J = read(pose, ray, float(depth), float(gain))
        rho, slope, weight = logistic(residual, s, outlier_floor)
        cost += rho
        gradient += slope * J
        hessian += (weight if curvature == "irls" else slope**2) * np.outer(J, J)
    return cost, gradient, hessian
