# SPDX-License-Identifier: MIT
"""Tables, walls and boards around a location in a depth image: planes larger than the object."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MIN_M, PER_M2 = 0.005, 0.005  # half thickness of a plane at distance z: MIN_M + PER_M2 z^2
POINTS = 3000  # measurements that a plane is looked for among
TRIALS = 120
MAX_PLANES = 5
SHARE = 0.03  # of the surroundings, that a plane holds at least
LARGER = 1.3  # times the object's size, that its measurements reach in one piece
FACES = 0.85  # cosine of the angle between a measurement's own normal and the plane's
BLUR_PX, APART_PX = 5, 3  # a normal is that of the mean points so far to its sides


class NearPlane(NamedTuple):
    """``normal . p + offset = 0``, the normal towards the camera; its pixels and their extent."""

    normal: Array
    offset: float
    pixels: Mask
    extent_m: float

    def height(self, points: Array) -> Array:
        """Height of points (..., 3) above the plane, on the camera's side."""
        return points @ self.normal + self.offset


def tolerance_m(z: Array) -> Array:
    """Tolerance for a measurement at distance z to belong to a plane."""
    return MIN_M + PER_M2 * z**2


def surface_normals(points: Array, read: Mask) -> Array:
    """(H, W, 3) unit normals towards the camera of points (H, W, 3); 0 at the border of valid measurements."""
    import cv2

    weight = cv2.blur(read.astype(np.float64), (BLUR_PX, BLUR_PX))
    blurred = cv2.blur(np.where(read[..., None], points, 0.0), (BLUR_PX, BLUR_PX))
    mean: Array = blurred / np.maximum(weight, 1e-9)[..., None]
    k = APART_PX
    normals = np.zeros(points.shape)
    right = mean[k:-k, 2 * k :] - mean[k:-k, : -2 * k]
    down = mean[2 * k :, k:-k] - mean[: -2 * k, k:-k]
    n = np.cross(down, right)
    length = np.linalg.norm(n, axis=-1, keepdims=True)
    whole = cv2.erode(read.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    normals[k:-k, k:-k] = np.where(length > 0, n / np.maximum(length, 1e-12), 0)
    normals[~whole] = 0
    return normals


def planes_near(points: Array, normals: Array, around: Mask, size_m: float) -> list[NearPlane]:
    """Planes among the pixels `around` with a connected extent larger than an object of `size_m`."""
    rng = np.random.default_rng(0)
    left = around & (np.abs(normals).sum(axis=-1) > 0)
    least = max(30, int(SHARE * np.count_nonzero(left)))
    found: list[NearPlane] = []
    for _ in range(2 * MAX_PLANES):
        if len(found) == MAX_PLANES or np.count_nonzero(left) < least:
            break
        normal, offset = _best(points[left], normals[left], rng)
        on = around & (np.abs(points @ normal + offset) < tolerance_m(points[..., 2]))
        agree = on & (normals @ normal > FACES)
        if np.count_nonzero(agree & left) < least:
            break
        left &= ~agree
        piece, extent = _largest_piece(agree, points)
        if extent > LARGER * size_m:
            found.append(NearPlane(normal, offset, _grown(piece, on), extent))
    return found


def _best(p: Array, n: Array, rng: np.random.Generator) -> tuple[Array, float]:
    """The plane through a measurement, by its normal, with the most inliers; refined."""
    if len(p) > POINTS:
        chosen = rng.choice(len(p), POINTS, replace=False)
        p, n = p[chosen], n[chosen]
    tries = rng.integers(len(p), size=TRIALS)
    tolerance = tolerance_m(p[:, 2])
    near = np.abs((p @ n[tries].T) - np.sum(p[tries] * n[tries], axis=1)) < tolerance[:, None]
    counts = np.count_nonzero(near & (n @ n[tries].T > FACES), axis=0)
    k = tries[int(np.argmax(counts))]
    normal, middle = n[k], p[k]
    for _ in range(3):
        on = (np.abs((p - middle) @ normal) < tolerance) & (n @ normal > FACES)
        if np.count_nonzero(on) < 3:
            break
        middle = p[on].mean(axis=0)
        fitted = np.linalg.eigh(np.cov((p[on] - middle).T))[1][:, 0]
        normal = fitted if fitted @ normal > 0 else -fitted
    return normal, float(-normal @ middle)


def _largest_piece(on: Mask, points: Array) -> tuple[Mask, float]:
    """The connected component with the largest extent, bridging small gaps, and its extent without 2 % at each end."""
    import cv2

    bridged = cv2.morphologyEx(on.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(bridged)
    best, reach = np.zeros(on.shape, bool), 0.0
    for k in np.argsort(-stats[1:, cv2.CC_STAT_AREA])[:3] + 1 if count > 1 else []:
        piece = (labels == k) & on
        p = points[piece]
        if len(p) < 30:
            continue
        along = np.linalg.eigh(np.cov(p.T))[1][:, 2]
        low, high = np.quantile(p @ along, [0.02, 0.98])
        if high - low > reach:
            best, reach = piece, float(high - low)
    return best, reach


def _grown(piece: Mask, on: Mask) -> Mask:
    """The piece and adjacent pixels on the plane, where normals are unknown."""
    import cv2

    return (cv2.dilate(piece.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0) & on
