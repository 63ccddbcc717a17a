# SPDX-License-Identifier: MIT
"""Capsules (segments with a radius) cast exactly, many at once: what fingers are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera

Array = NDArray[np.float64]
NEAREST_M = 0.05  # what reaches nearer to the camera is not drawn


@dataclass(frozen=True)
class Capsules:
    """N segments from `a` to `b` (N, 3) with `radius` (N,), metres."""

    a: Array
    b: Array
    radius: Array

    def __len__(self) -> int:
        return len(self.radius)

    def moved(self, T: Array) -> Capsules:
        """p -> T p."""
        R, t = T[:3, :3].T, T[:3, 3]
        return Capsules(self.a @ R + t, self.b @ R + t, self.radius)

    @classmethod
    def joined(cls, parts: list[Capsules]) -> Capsules:
        return cls(
            np.concatenate([p.a for p in parts]),
            np.concatenate([p.b for p in parts]),
            np.concatenate([p.radius for p in parts]),
        )


@dataclass(frozen=True)
class Hits:
    """Every pixel's ray with every capsule that it meets: flat pixel, capsule, depth (m), cosine of incidence."""

    pixel: NDArray[np.intp]
    capsule: NDArray[np.intp]
    depth: NDArray[np.float32]
    cosine: NDArray[np.float32]


def cast(capsules: Capsules, camera: Camera) -> Hits:
    """First meeting of each ray ``z r`` (``r`` with z = 1) with each capsule; capsules in the camera's frame."""
    pixel, k = _pairs(capsules, camera)
    x, y = camera.rays.reshape(-1, 2)[pixel].astype(np.float64).T
    a, axis, r2 = capsules.a[k], (capsules.b - capsules.a)[k], capsules.radius[k] ** 2
    # Distance of the ray's points from the infinite axis equals r: A z^2 + 2 B z + C = 0, scaled by |axis|^2.
    rr = x * x + y * y + 1
    ra = x * a[:, 0] + y * a[:, 1] + a[:, 2]
    rx = x * axis[:, 0] + y * axis[:, 1] + axis[:, 2]
    xx, ax, aa = _dot(axis, axis), _dot(a, axis), _dot(a, a)
    A, B = xx * rr - rx * rx, ax * rx - xx * ra
    C = xx * (aa - r2) - ax * ax
    inside = B * B - A * C
    meets = (inside >= 0) & (A > 1e-15)
    with np.errstate(invalid="ignore", divide="ignore"):
        z = np.where(meets, (-B - np.sqrt(inside)) / A, 0)
    along = z * rx - ax  # of the meeting, in units of |axis|^2
    # Beyond an end it is the end's ball that the ray meets, or nothing.
    at_end = meets & ((along < 0) | (along > xx))
    end = np.where((along > xx)[:, None], capsules.b[k], a)
    re, ee = x * end[:, 0] + y * end[:, 1] + end[:, 2], _dot(end, end)
    ball = re * re - rr * (ee - r2)
    with np.errstate(invalid="ignore"):
        z = np.where(at_end, (re - np.sqrt(ball)) / rr, z)
    meets &= ~at_end | (ball >= 0)
    meets &= z > NEAREST_M
    z, x, y, k, pixel = z[meets], x[meets], y[meets], k[meets], pixel[meets]
    p = z[:, None] * np.stack([x, y, np.ones_like(x)], axis=1)
    a, axis = a[meets], axis[meets]
    h = np.clip(_dot(p - a, axis) / np.maximum(_dot(axis, axis), 1e-18), 0, 1)
    normal = p - a - h[:, None] * axis
    cosine = -_dot(normal, p) / (np.linalg.norm(normal, axis=1) * np.linalg.norm(p, axis=1))
    return Hits(pixel, k, z.astype(np.float32), np.clip(cosine, 0, 1).astype(np.float32))


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("ij,ij->i", a, b)


def _pairs(capsules: Capsules, camera: Camera) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(pixel, capsule) for the pixels in the box around each capsule's picture."""
    h, w = camera.shape
    ends = np.stack([capsules.a, capsules.b])
    z = ends[..., 2] - capsules.radius
    near = np.maximum(z, NEAREST_M)
    px = camera.project(np.where(z[..., None] > 0, ends, [0, 0, 1.0]))
    # A ball's outline is wider than r f / z: by its nearer side, and towards the image's border.
    stretch = 1 + np.hypot(*(ends[..., :2] / np.maximum(ends[..., 2:], NEAREST_M)).transpose(2, 0, 1)) ** 2
    reach = max(camera.fx, camera.fy) * capsules.radius / near * stretch + 2
    low = np.floor((px - reach[..., None]).min(axis=0))
    high = np.ceil((px + reach[..., None]).max(axis=0)) + 1
    low = np.clip(low, 0, [w, h]).astype(np.intp)
    high = np.clip(high, 0, [w, h]).astype(np.intp)
    size = np.maximum(high - low, 0)
    size[(z <= 0).any(axis=0)] = 0
    count = size[:, 0] * size[:, 1]
    capsule = np.repeat(np.arange(len(capsules)), count)
    within = np.arange(len(capsule)) - np.repeat(np.cumsum(count) - count, count)
    row = low[capsule, 1] + within // size[capsule, 0]
    column = low[capsule, 0] + within % size[capsule, 0]
    return row * w + column, capsule
