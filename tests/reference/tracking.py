# SPDX-License-Identifier: MIT
"""The frame's recipe in plain numpy, piece by piece: the twin of cpp/tracking."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference.energies import DepthLogistic, Field, find_hit

Array = NDArray[Any]

BLIND_SLOPE = 0.03
STEEP_GAIN = 2.0  # 1 / slope of a hit beyond which it counts as grazing
MIN_SLOPE = 0.05


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
    """What a covariance is made of, psi = d cost / d residual.

    A = sum psi' J J^T and B = sum psi^2 J J^T, with class means of psi' and psi^2 over the weight psi / residual in
    place of each pixel's own; geometry, the mean of d phi d phi^T over the inliers; the gradients that the
    interpolant's error and the rays without a hit make.
    """

    A: Array
    B: Array
    geometry: Array
    rounding: Array
    missed: Array


def interpolation_error(field: Field, p_cam: Array, voxel_size: float) -> float:
    """By how much the interpolant lies above the field on average over a cell: h^2 / 12 times the Laplacian."""
    centre = field.row(p_cam).phi
    steps = voxel_size * np.concatenate([np.eye(3), -np.eye(3)])
    return float(sum(field.row(p_cam + step).phi - centre for step in steps)) / 12


def summarize(
    field: Field, rays: Array, depths: Array, gains: Array, penalty: DepthLogistic, voxel_size: float
) -> Sums:
    """Sums over all pixels, in three classes: no hit, hit, hit at a grazing angle."""
    geometry, inliers = np.zeros((6, 6)), 0
    rounding, missed = np.zeros(6), np.zeros(6)
    JJ, weights, curvatures, slopes2 = np.zeros((3, 6, 6)), np.zeros(3), np.zeros(3), np.zeros(3)
    for ray, depth, gain in zip(rays, depths, gains, strict=True):
        hit = gain == 0
        if hit:
            z, slope, J_phi, _ = find_hit(field, ray, float(depth))
            residual, factor = z - depth, -1 / slope
        else:
            phi, _, J_phi = field.row(depth * ray)
            residual, factor = gain * phi, gain
        J, curve, psi_slope = factor * J_phi, penalty(residual), penalty.second_derivative(residual)
        weight = curve.slope / residual if residual else 1 / (2 * penalty.scale_m**2)
        kind = 0 if not hit else 1 if factor < STEEP_GAIN else 2
        JJ[kind] += weight * np.outer(J, J)
        weights[kind] += weight
        curvatures[kind] += psi_slope
        slopes2[kind] += curve.slope**2
        if hit:
            rounding += psi_slope * factor * interpolation_error(field, z * ray, voxel_size) * J
        else:
            missed += curve.slope * J
        if weight > 0.5 * (1 / (2 * penalty.scale_m**2)):
            geometry += np.outer(J_phi, J_phi)
            inliers += 1
    A, B = np.zeros((6, 6)), np.zeros((6, 6))
    for k in np.nonzero(weights)[0]:
        A += max(MIN_SLOPE, curvatures[k] / weights[k]) * JJ[k]
        B += slopes2[k] / weights[k] * JJ[k]
    return Sums(A, B, geometry / max(1, inliers), rounding, missed)


def increment_covariance(sums: Sums, diameter: float, correlation_area_px: float = 1.0) -> Array:
    """A^-1 B A^-1 of the increment (v, w), with one observation of sd (diameter, pi) per direction.

    Directions along which phi hardly changes over the inliers (rms slope below BLIND_SLOPE, a turn taken at half the
    diameter) are taken out of the sums first: what is left there is the grain of the voxels. What the two known
    biases do to the pose is added as if it were an sd.
    """
    unit = np.diag([1, 1, 1, *[2 / diameter] * 3])
    prior = np.diag([diameter**-2] * 3 + [np.pi**-2] * 3)
    slopes2, vectors = np.linalg.eigh(unit @ sums.geometry @ unit)
    seen = vectors[:, slopes2 >= BLIND_SLOPE**2]
    P = np.linalg.inv(unit) @ seen @ seen.T @ unit
    A_inverse = np.linalg.inv(P @ sums.A @ P.T + prior)
    C: Array = A_inverse @ (correlation_area_px * P @ sums.B @ P.T + prior) @ A_inverse
    for bias in (sums.rounding, sums.missed):
        shift = A_inverse @ P @ bias
        C += np.outer(shift, shift)
    return C


def camera_covariance(C: Array, T_cam_obj: Array, origin_obj: Array) -> Array:
    """The same in camera axes about the object's origin (x, y, z, rx, ry, rz), t = t^ + d, R = Exp(r) R^.

    T_cam_obj is the pose of the centred frame, origin_obj the caller's origin in it.
    """
    R = T_cam_obj[:3, :3]
    J = np.zeros((6, 6))
    J[:3, :3] = J[3:, 3:] = -R
    J[:3, 3:] = np.cross(np.eye(3), R @ origin_obj) @ R
    return J @ C @ J.T


SMOOTH_SHARE, SMOOTH_EVERY, OWN_NORMAL = 0.06, 2, 1e-3
HALF_PER_SPREAD = 1.5


def seen_half(points: Array) -> float:
    """Half a diameter of what has been seen, by the spread of points on it (N, 3)."""
    return HALF_PER_SPREAD * float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def least_form_slope(points: Array, voxel_size: float) -> float:
    return float(np.hypot(0.045, 1.5 * voxel_size / seen_half(points)))


def seen_form(
    points: Array, normals: Array, diameter: float, depth: Array, K: Array, T_cam_obj: Array, tolerance: float
) -> Array:
    """Mean of J J^T, J = (n, t p x n), over every second point of a fused shape that faces the camera and is read.

    n: means of the normals around the point, of every other point and of the rest. Of the two, a and b, the noise
    differs: (a b^T + b a^T - d d^T) / 2 with d = a - b has none of it. t: half the diameter over that of the seen part.
    """
    fx, fy, cx, cy = K
    eye, turn = np.linalg.inv(T_cam_obj)[:3, 3], diameter / 2 / seen_half(points)
    seen = []
    for p, own in zip(points[::SMOOTH_EVERY], normals[::SMOOTH_EVERY], strict=True):
        x, y, z = T_cam_obj[:3, :3] @ p + T_cam_obj[:3, 3]
        v, u = int(np.floor(fy * y / z + cy + 0.5)), int(np.floor(fx * x / z + cx + 0.5))
        inside = z > 0 and 0 <= v < depth.shape[0] and 0 <= u < depth.shape[1]
        if own @ (eye - p) <= 0 or not inside or not depth[v, u] > 0 or abs(depth[v, u] - z) > tolerance:
            continue
        rows = []
        for half in (0, 1):
            others, sides = points[half::2], normals[half::2]
            near = (np.linalg.norm(others - p, axis=1) < SMOOTH_SHARE * diameter) & (sides @ own > 0)
            n = sides[near].sum(axis=0) + OWN_NORMAL * own
            n /= np.linalg.norm(n)
            rows.append(np.concatenate([n, turn * np.cross(p, n)]))
        a, b = rows
        seen.append((np.outer(a, b) + np.outer(b, a) - np.outer(a - b, a - b)) / 2)
    form: Array = np.mean(seen, axis=0) if seen else np.zeros((6, 6))
    return form
