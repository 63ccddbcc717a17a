# SPDX-License-Identifier: MIT
"""The frame's recipe in plain numpy, piece by piece: the twin of cpp/tracking."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.reference.energies import DepthLogistic, Field, find_hit
from sdftrack.reference.optim import hat

Array = NDArray[Any]

BLIND_SLOPE = 0.03
GRAIN = 5e-4  # voxels; over the squared slope: what the voxels do to a direction that few edges hold


class Shape(NamedTuple):
    """Where an object's own frame is centred: the middle of the box of {phi <= 0} (m), its half size, its diagonal."""

    centre: Array
    half_box: Array
    diameter: float


def make_shape(values: Array, voxel_size: float, origin: Array) -> Shape:
    """Box of the balls of radius |phi| about the voxels inside: each lies inside, together they reach every side."""
    inside = np.nonzero(values <= 0)
    at = np.stack(inside[::-1], axis=1).astype(np.float64)
    radius = -values[inside][:, None] / voxel_size
    low, high = (at - radius).min(axis=0), (at + radius).max(axis=0)
    half = voxel_size * (high - low) / 2
    return Shape(origin + voxel_size * (low + high) / 2, half, 2 * float(np.linalg.norm(half)))


def centred(T_cam_obj: Array, centre: Array) -> Array:
    """T_obj_cam of the centred object frame: p_centred = p_obj - centre."""
    shift = np.eye(4)
    shift[:3, 3] = centre
    return np.linalg.inv(T_cam_obj @ shift)


def select_pixels(
    depth: Array, K: Array, shape: Shape, T_obj_cam: Array, padding: float
) -> tuple[Array, Array]:
    """Rays (N, 3) and depths (N,) of the pixels whose points lie in the padded box, row by row."""
    fx, fy, cx, cy = K
    rays, depths = [], []
    for v, u in np.ndindex(*depth.shape):
        z = float(depth[v, u])
        if not z > 0:
            continue
        ray = np.array([(u - cx) / fx, (v - cy) / fy, 1])
        p = T_obj_cam[:3, :3] @ (z * ray) + T_obj_cam[:3, 3]
        if (np.abs(p) <= shape.half_box + padding).all():
            rays.append(ray)
            depths.append(z)
    return np.array(rays), np.array(depths)


class Sums(NamedTuple):
    """A = sum psi' J J^T, B = sum psi^2 J J^T, psi = d cost / d residual; mean of d phi d phi^T over the inliers."""

    A: Array
    B: Array
    geometry: Array


def summarize(field: Field, rays: Array, depths: Array, gains: Array, penalty: DepthLogistic) -> Sums:
    """What a covariance is made of."""
    A, B, geometry, inliers = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)), 0
    for ray, depth, gain in zip(rays, depths, gains, strict=True):
        if gain == 0:
            z, slope, J_phi, _ = find_hit(field, ray, float(depth))
            residual, factor = z - depth, -1 / slope
        else:
            phi, _, J_phi = field.row(depth * ray)
            residual, factor = gain * phi, gain
        J = factor * J_phi
        curve = penalty(residual)
        A += penalty.second_derivative(residual) * np.outer(J, J)
        B += curve.slope**2 * np.outer(J, J)
        if curve.curvature > 0.5 * (1 / (2 * penalty.scale_m**2)):
            geometry += np.outer(J_phi, J_phi)
            inliers += 1
    return Sums(A, B, geometry / max(1, inliers))


def increment_covariance(
    sums: Sums, diameter: float, voxel_size: float, correlation_area_px: float = 1.0
) -> Array:
    """A^-1 B A^-1 of the increment (v, w), with one observation of sd (diameter, pi) per direction.

    Directions along which phi hardly changes over the inliers (rms slope below BLIND_SLOPE, a turn taken at half the
    diameter) are taken out of A and B first: what is left there is the grain of the voxels. To the others comes what
    GRAIN voxels over the squared slope, the error of the voxels themselves.
    """
    unit = np.diag([1, 1, 1, *[2 / diameter] * 3])
    prior = np.diag([diameter**-2] * 3 + [np.pi**-2] * 3)
    slopes2, vectors = np.linalg.eigh(unit @ sums.geometry @ unit)
    is_seen = slopes2 >= BLIND_SLOPE**2
    seen = vectors[:, is_seen]
    P = np.linalg.inv(unit) @ seen @ seen.T @ unit
    A = P @ sums.A @ P.T + prior
    B = correlation_area_px * P @ sums.B @ P.T + prior
    grain = seen @ np.diag((GRAIN * voxel_size / slopes2[is_seen]) ** 2) @ seen.T
    C: Array = np.linalg.inv(A) @ B @ np.linalg.inv(A) + unit @ grain @ unit
    return C


def camera_covariance(C: Array, T_cam_obj: Array, origin_obj: Array) -> Array:
    """The same in camera axes about the object's origin (x, y, z, rx, ry, rz), t = t^ + d, R = Exp(r) R^.

    T_cam_obj is the pose of the centred frame, origin_obj the caller's origin in it.
    """
    R = T_cam_obj[:3, :3]
    J = np.zeros((6, 6))
    J[:3, :3] = J[3:, 3:] = -R
    J[:3, 3:] = hat(R @ origin_obj) @ R
    return J @ C @ J.T


def fit_plane(
    points: Array, normal: Array, offset: float, reach: float, rounds: int = 5
) -> tuple[Array, float]:
    """Plane n . p + d = 0 through (N, 3) points, n towards the camera: total least squares, Tukey's weights.

    Starts from (normal, offset); points farther than `reach` from the plane of a round have no weight in the next.
    """
    for _ in range(rounds):
        u = (points @ normal + offset) / reach
        w = np.where(np.abs(u) < 1, (1 - u**2) ** 2, 0)
        mean = w @ points / w.sum()
        spread = (points - mean).T @ (w[:, None] * (points - mean))
        normal = np.linalg.eigh(spread)[1][:, 0]
        normal = -normal if normal @ mean > 0 else normal
        offset = -float(normal @ mean)
    return normal, offset
