# SPDX-License-Identifier: MIT
"""Centre of a ball of known radius in a depth image, by the tracker's ray-hit residual with translation only.

Thesis section 3.7 (the 3-DoF version of section 3.5's tracker); docs/math/color_to_depth.md, eq. 2 to 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera

Array = NDArray[np.float64]
MIN_COSINE = (
    0.5  # measurements at more than 60 degrees of incidence are at the mercy of lateral noise and edge loss
)
MIN_PIXELS = 40
MIN_RADIUS_PX = 4.0
MIN_SHARE = 0.4  # of the ball's pixels that agree: a hand may hide half of it
MIN_FREE = 0.5  # of the pixels around it that lie behind it
NOISE_FLOOR_M = 0.0003
MAX_NOISE = 0.002  # m at a distance, plus as much for each m^2: twice a Kinect's, steps of disparity included
FARTHEST_M = 5.0
STAGES = ((0.5, 3), (0.2, 4), (0.0, 6))  # gate in radii (0: by the noise alone), steps
TUKEY = 4.685  # in standard deviations: 95 % efficient where there are no outliers
# The matched filter of the search: rings in fractions of the image radius, and points on each.
INNER, AROUND, OUTER, ROUND = (0.35, 0.62, 0.8), 8, 1.3, 16


@dataclass(frozen=True, eq=False)
class DepthBall:
    """Centre (m, depth camera), its covariance (3, 3), depth noise sd (m), pixels used, visible fraction."""

    center_cam: Array
    covariance: Array
    noise_m: float
    pixels: int
    share: float


def ray_hits(rays: Array, center_cam: Array, radius_m: float) -> tuple[Array, Array]:
    """First intersections of rays with a sphere.

    Parameters
    ----------
    rays : (N, 2) float64
        x / z and y / z.
    center_cam : (3,) float64, m
    radius_m : float

    Returns
    -------
    z : (N,) float64
        Depth of the intersection, m; NaN if the ray misses.
    dz : (N, 3) float64
        Its derivative with respect to the centre: ``n / (n . d)`` with the outward normal n and the ray d.
    """
    d = np.column_stack([rays, np.ones(len(rays))])
    dd, dc = np.einsum("nk,nk->n", d, d), d @ center_cam
    inside = dc * dc - dd * (center_cam @ center_cam - radius_m**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        z = (dc - np.sqrt(inside)) / dd
        normal = (z[:, None] * d - center_cam) / radius_m
        dz = normal / np.einsum("nk,nk->n", normal, d)[:, None]
    return z, dz


def fit_ball(
    depth: NDArray[np.float32], camera: Camera, radius_m: float, start_cam: Array
) -> DepthBall | None:
    """Fit the ball's centre from a start within about half a radius; None if the measurements are not of a ball.

    Parameters
    ----------
    depth : (H, W) float32, m, 0 = no measurement
    camera : Camera
    radius_m : float
    start_cam : (3,) centre to start from, depth camera, m

    Returns
    -------
    DepthBall or None

    Examples
    --------
    >>> ball = fit_ball(frame.depth, camera, 0.04, [0.0, 0.0, 1.0])  # doctest: +SKIP
    """
    center = np.array(start_cam, dtype=np.float64)
    noise = 0.002
    for gate_radii, steps in STAGES:
        for _ in range(steps):
            rows, columns = _window(camera, center, radius_m, 1.0)
            z = depth[rows, columns].ravel().astype(np.float64)
            rays = camera.rays[rows, columns].reshape(-1, 2).astype(np.float64)
            hit, dz = ray_hits(rays, center, radius_m)
            # |dz| = 1 / (n . d), so this is the cosine of incidence.
            cosine = 1 / (np.linalg.norm(dz, axis=1) * np.sqrt((rays**2).sum(axis=1) + 1))
            facing = cosine > MIN_COSINE
            near = facing & (z > 0)
            near[near] &= np.abs(z[near] - hit[near]) < max(gate_radii * radius_m, TUKEY * noise)
            if np.count_nonzero(near) < MIN_PIXELS:
                return None
            r, J = z[near] - hit[near], dz[near]
            noise = max(1.4826 * float(np.median(np.abs(r))), NOISE_FLOOR_M)
            u = r / (TUKEY * noise)
            w = np.where(np.abs(u) < 1, (1 - u * u) ** 2, 0)
            H = J.T @ (w[:, None] * J)
            try:
                step = np.linalg.solve(H + 1e-9 * np.trace(H) * np.eye(3), J.T @ (w * r))
            except np.linalg.LinAlgError:
                return None
            center = center + step
            if not (np.isfinite(center).all() and radius_m < center[2] < FARTHEST_M):
                return None
            if gate_radii == 0 and np.abs(step).max() < 1e-6:
                break
    agree = int(np.count_nonzero(w > 0))
    share = agree / max(1, int(np.count_nonzero(facing)))
    if (
        agree < MIN_PIXELS
        or share < MIN_SHARE
        or noise > min(0.15 * radius_m, MAX_NOISE * (1 + center[2] ** 2))
    ):
        return None
    if _free_around(depth, camera, center, radius_m) < MIN_FREE:
        return None
    return DepthBall(center, noise**2 * np.linalg.inv(H), noise, agree, share)


def search_balls(
    depth: NDArray[np.float32], camera: Camera, radius_m: float, tried: int = 8
) -> list[DepthBall]:
    """Find all regions with the ball's shape and size, the most completely visible first.

    Every fourth pixel is tested as the nearest point of a ball: depth on three rings must match a sphere, and a ring
    around it must lie behind. The best candidates are fitted.

    Parameters
    ----------
    depth : (H, W) float32, m, 0 = no measurement
    camera : Camera
    radius_m : float
    tried : int
        Number of candidates to fit.

    Returns
    -------
    list of DepthBall
        Empty if none is found. May include round objects in the background.
    """
    import cv2

    smooth = cv2.medianBlur(np.ascontiguousarray(depth), 5)
    h, w = depth.shape
    v, u = (a.ravel() for a in np.mgrid[2:h:4, 2:w:4])
    z = smooth[v, u].astype(np.float64)
    px = 0.5 * (camera.fx + camera.fy) * radius_m / np.maximum(z + radius_m, 0.01)
    ring = 2 * np.pi * np.arange(ROUND) / ROUND
    free = np.zeros(len(u))
    keep = (z > 0.1) & (z < FARTHEST_M) & (px > MIN_RADIUS_PX)
    for part in (ring[::4], np.delete(ring, np.s_[::4])):
        # Most of an image is surfaces that go on all around: four points send them away.
        u, v, z, px, free = u[keep], v[keep], z[keep], px[keep], free[keep]
        for angle in part:
            at = _sample(smooth, u + OUTER * px * np.cos(angle), v + OUTER * px * np.sin(angle))
            free += (at <= 0) | (at > z + radius_m)
        keep = free >= 1
    keep = free > MIN_FREE * ROUND
    u, v, z, px, free = u[keep], v[keep], z[keep], px[keep], free[keep]
    if not len(u):
        return []
    tolerance = 0.006 + 0.004 * z * z  # noise of the nearest point and of the others, at 3 sd of a Kinect
    good = np.zeros(len(u))
    for rho in INNER:
        behind = radius_m * (1 - np.sqrt(1 - rho * rho))
        for angle in 2 * np.pi * (np.arange(AROUND) + rho) / AROUND:
            at = _sample(smooth, u + rho * px * np.cos(angle), v + rho * px * np.sin(angle))
            good += (at > 0) & (np.abs(at - z - behind) < tolerance)
    good, free = good / (len(INNER) * AROUND), free / ROUND
    score = np.where(good > MIN_SHARE, good + 0.5 * free, 0)
    found: list[DepthBall] = []
    for _ in range(tried):
        k = int(np.argmax(score))
        if score[k] <= 0:
            break
        ray = np.append(camera.rays[v[k], u[k]].astype(np.float64), 1)
        ball = fit_ball(depth, camera, radius_m, ray * z[k] + radius_m * ray / np.linalg.norm(ray))
        if ball is not None and not any(
            np.linalg.norm(ball.center_cam - f.center_cam) < radius_m for f in found
        ):
            found.append(ball)
        score[np.hypot(u - u[k], v - v[k]) < px[k]] = 0
    return sorted(found, key=lambda b: -b.share)


def _free_around(depth: NDArray[np.float32], camera: Camera, center: Array, radius_m: float) -> float:
    """Fraction of the pixels in a ring around the outline that lie behind the ball."""
    angle = 2 * np.pi * np.arange(48) / 48
    ring = center + 1.3 * radius_m * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(48)])
    px = camera.project(ring)
    at = _sample(depth, px[:, 0], px[:, 1])
    return float(np.mean((at <= 0) | (at > center[2] + 0.5 * radius_m)))


def _window(camera: Camera, center: Array, radius_m: float, radii: float) -> tuple[slice, slice]:
    """Rows and columns of the ball in the image."""
    u, v = camera.project(center)
    reach = 1.2 * radii * max(camera.fx, camera.fy) * radius_m / max(center[2] - radius_m, 0.02) + 1
    x0, x1 = np.clip([int(u - reach), int(u + reach) + 2], 0, camera.width)
    y0, y1 = np.clip([int(v - reach), int(v + reach) + 2], 0, camera.height)
    return slice(int(y0), int(y1)), slice(int(x0), int(x1))


def _sample(depth: NDArray[Any], u: Array, v: Array) -> Array:
    """Nearest depth measurement; -1 outside the image."""
    h, w = depth.shape
    x, y = np.rint(u).astype(np.intp), np.rint(v).astype(np.intp)
    inside = (x >= 0) & (x < w) & (y >= 0) & (y < h)
    at = depth[np.clip(y, 0, h - 1), np.clip(x, 0, w - 1)].astype(np.float64)
    return np.where(inside, at, -1.0)
