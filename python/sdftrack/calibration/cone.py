# SPDX-License-Identifier: MIT
"""The cone of tangent rays of a sphere: its axis passes through the centre, unlike the outline's centroid.

Unit rays d of the outline obey ``d . n = cos(a)`` with the axis n and the half angle a, sin(a) = radius / distance;
``m = n / cos(a)`` makes it linear, ``d . m = 1`` (docs/math/color_to_depth.md, eq. 6 and 7).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera

Array = NDArray[np.float64]
TUKEY = 4.685
FLOOR_PX = 0.02
LENS_STEPS = 20  # each leaves a tenth or less of the error under a usual lens


@dataclass(frozen=True, eq=False)
class Cone:
    """Unit axis, half angle (rad), image of the axis (px) and its covariance (2, 2), px^2."""

    axis: Array
    half_angle_rad: float
    center_px: Array
    covariance_px: Array

    def residuals_px(self, edges_px: Array, camera: Camera) -> Array:
        """Distances of edges (N, 2) outside the cone, in pixels at the image centre."""
        cosine = np.clip(rays_of(edges_px, camera) @ self.axis, -1, 1)
        return _focal(camera) * (np.arccos(cosine) - self.half_angle_rad)

    def outline(self, camera: Camera, count: int) -> tuple[Array, Array, float]:
        """`count` points of the outline (px), its unit normals in the image, mean radius (px)."""
        at = camera.project(_circle(self.axis, self.half_angle_rad, count))
        tangent = np.roll(at, -1, axis=0) - np.roll(at, 1, axis=0)
        normal = np.column_stack([tangent[:, 1], -tangent[:, 0]])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        centre = at.mean(axis=0)
        normal *= np.sign(np.einsum("nk,nk->n", normal, at - centre))[:, None]
        return at, normal, float(np.linalg.norm(at - centre, axis=1).mean())


def rays_of(px: Array, camera: Camera) -> Array:
    """(N, 3) unit rays of pixels (N, 2), distortion removed."""
    f = np.array([camera.fx, camera.fy])
    xy = (px - np.array([camera.cx, camera.cy])) / f
    if camera.distortion:
        for _ in range(LENS_STEPS):
            xy = xy + (px - camera.project(np.column_stack([xy, np.ones(len(xy))]))) / f
    d = np.column_stack([xy, np.ones(len(xy))])
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def fit_cone(edges_px: Array, camera: Camera) -> Cone | None:
    """Robust fit of a cone to the rays of edges (N, 2), px; None if it fails.

    >>> fit_cone(outline_of_sphere(camera, [0.1, 0, 1], 0.04), camera).center_px  # doctest: +SKIP
    """
    d = rays_of(edges_px, camera)
    weight: Array = np.ones(len(d))
    m: NDArray[Any] = np.zeros(3)
    f = _focal(camera)
    for _ in range(6):
        A = d.T @ (weight[:, None] * d)
        try:
            m = np.linalg.solve(A, d.T @ weight)
        except np.linalg.LinAlgError:
            return None
        length = float(np.linalg.norm(m))
        if not np.isfinite(length) or length <= 1 or m[2] <= 0:
            return None
        # cos(a) = 1 / |m|, and a change of cos is -sin(a) of angle.
        px = -f * (d @ m - 1) / np.sqrt(length**2 - 1)
        sd = max(1.4826 * float(np.median(np.abs(px))), FLOOR_PX)
        u = px / (TUKEY * sd)
        weight = np.where(np.abs(u) < 1, (1 - u * u) ** 2, 0)
    axis = m / length
    sd = max(sd, FLOOR_PX)
    # Samples nearer than a pixel share their pixels: no more edges than pixels of the outline count.
    half = float(np.arccos(1 / length))
    counted = min(1.0, 2 * np.pi * f * half / len(d))
    C_m = (sd * np.sqrt(length**2 - 1) / f) ** 2 * np.linalg.inv(A) / counted
    step = 1e-6
    J = np.column_stack(
        [(camera.project(m + step * e) - camera.project(m - step * e)) / (2 * step) for e in np.eye(3)]
    )
    return Cone(axis, half, camera.project(axis), J @ C_m @ J.T)


def outline_of_sphere(camera: Camera, center: Array, radius_m: float, count: int = 360) -> Array:
    """(count, 2) pixels of the outline of a sphere, exact; `center` in the camera's frame, m."""
    c = np.asarray(center, dtype=np.float64)
    distance = float(np.linalg.norm(c))
    return camera.project(_circle(c / distance, float(np.arcsin(radius_m / distance)), count))


def _circle(axis: Array, half_angle: float, count: int) -> Array:
    """Unit rays of a cone."""
    side = np.cross(axis, [1.0, 0, 0] if abs(axis[0]) < 0.9 else [0.0, 1, 0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    t = 2 * np.pi * np.arange(count)[:, None] / count
    ray: Array = np.cos(half_angle) * axis + np.sin(half_angle) * (np.cos(t) * side + np.sin(t) * other)
    return ray


def _focal(camera: Camera) -> float:
    return float(np.sqrt(camera.fx * camera.fy))
