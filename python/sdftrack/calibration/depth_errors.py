# SPDX-License-Identifier: MIT
"""Errors of a depth image relative to a known surface: the largest plane in it, or a known object at a known pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.camera import Camera
from sdftrack.frame import Frame

Array = NDArray[np.float64]
WINDOW_PX = 31  # wider than noise is shared, narrower than what bends a surface
PATCH_PX, MIN_PATCH_PX = 61, 9  # the size of a part of an object,
PARTS = 4  # of which so many lie side by side
FILLED = 0.6  # of a window
EDGE_PX = 4  # measurements so near the edge of an object or of a hole are left out
FAR_M = 0.04  # from an object's surface: another thing
CLIPPED = 4.0  # sd


@dataclass(frozen=True)
class DepthErrors:
    """For one image: measured minus expected depth (m), NaN where unknown; expected depth; tan(incidence)."""

    error: Array
    depth: Array
    tangent: Array

    @property
    def known(self) -> NDArray[np.bool_]:
        """Pixels with a known error."""
        return np.isfinite(self.error)


def errors_of_plane(frame: Frame, camera: Camera) -> DepthErrors:
    """Errors relative to the largest plane; ValueError if there is none."""
    from sdftrack.imaging.plane import remove_plane

    beside, (normal, offset) = remove_plane(frame, camera, feet=False)
    assert frame.depth is not None
    measured = frame.depth.astype(np.float64)
    rays = _rays(camera)
    along = rays @ normal
    on = (measured > 0) & ~beside & (along < -1e-3)
    expected = np.where(on, -offset / np.where(on, along, -1), np.nan)
    cosine = np.abs(along) / np.linalg.norm(rays, axis=-1)
    return _kept(measured, expected, cosine, on)


def errors_of_object(frame: Frame, camera: Camera, shape: Any, T_cam_obj: ArrayLike) -> DepthErrors:
    """Errors relative to an SDF at its pose."""
    assert frame.depth is not None
    measured = frame.depth.astype(np.float64)
    depth, normals = shape.render(camera, np.asarray(T_cam_obj, np.float64))
    expected = depth.astype(np.float64)
    rays = _rays(camera)
    cosine = np.abs(np.einsum("hwc,hwc->hw", rays, normals)) / np.linalg.norm(rays, axis=-1)
    on = (measured > 0) & (expected > 0) & (np.abs(measured - expected) < FAR_M)
    return _kept(measured, expected, cosine, on)


def _rays(camera: Camera) -> Array:
    return np.dstack([camera.rays, np.ones(camera.shape)]).astype(np.float64)


def _kept(measured: Array, expected: Array, cosine: Array, on: NDArray[np.bool_]) -> DepthErrors:
    """Remove pixels near an edge."""
    import cv2

    kernel = np.ones((2 * EDGE_PX + 1,) * 2, np.uint8)
    whole = cv2.morphologyEx(on.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    inside = on & (cv2.erode(whole, kernel, borderValue=0) > 0)
    cosine = np.clip(cosine, 0.05, 1.0)
    return DepthErrors(
        np.where(inside, measured - expected, np.nan), expected, np.sqrt(1 - cosine**2) / cosine
    )


def _mean_about(values: Array, known: NDArray[np.bool_], side: int) -> tuple[Array, Array]:
    """Mean of the known values in a window around each pixel, and the known fraction of the window."""
    import cv2

    share = cv2.boxFilter(known.astype(np.float64), -1, (side, side), borderType=cv2.BORDER_CONSTANT)
    total = cv2.boxFilter(np.where(known, values, 0.0), -1, (side, side), borderType=cv2.BORDER_CONSTANT)
    return np.asarray(total / np.maximum(share, 1e-9), np.float64), np.asarray(share, np.float64)


def rough_part(errors: DepthErrors) -> Array:
    """Errors minus their local mean; NaN where unknown. Outliers are removed."""
    known = errors.known
    mean, share = _mean_about(errors.error, known, WINDOW_PX)
    rough = np.where(known & (share > FILLED), errors.error - mean, np.nan)
    if np.isfinite(rough).any():
        sd = np.nanmedian(np.abs(rough)) / 0.6745
        rough[np.abs(rough) > max(CLIPPED * sd, 1e-12)] = np.nan
    return rough


def smooth_part(errors: DepthErrors) -> Array:
    """Means over adjacent patches, (N,)."""
    half = int(np.clip(np.sqrt(errors.known.sum()) / PARTS, MIN_PATCH_PX, PATCH_PX)) // 2
    mean, share = _mean_about(errors.error, errors.known, 2 * half + 1)
    centres = np.zeros(mean.shape, bool)
    centres[half :: 2 * half + 1, half :: 2 * half + 1] = True
    return mean[centres & (share > FILLED)]


# -- Fits of noise and bias models to measurements from single images


BINS_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
STEP = 1.1  # of a bin of distances
ENOUGH = 400  # measurements of a bin
SPAN = 1.3  # largest over smallest distance, from which on growth with distance can be told
ROUNDS = 60
MIN_M = 1e-6


class NoiseSample(NamedTuple):
    """Noise sd (m) of measurements at one distance (m) and tan(incidence)."""

    depth: float
    tangent: float
    sd: float
    readings: int


def neighbour_correlation(rough: Array) -> float:
    """Correlation of neighbouring pixels; NaN if too few are known."""
    pairs = [(rough[:, 1:], rough[:, :-1]), (rough[1:], rough[:-1])]
    products, squares, count = 0.0, 0.0, 0
    for a, b in pairs:
        both = np.isfinite(a) & np.isfinite(b)
        products += float((a[both] * b[both]).sum())
        squares += float((a[both] ** 2 + b[both] ** 2).sum() / 2)
        count += int(both.sum())
    return products / squares if count >= ENOUGH and squares > 0 else math.nan


def noise_samples(errors: DepthErrors) -> list[NoiseSample]:
    """One sample per bin of distance and incidence with enough pixels of an image."""
    rough = rough_part(errors)
    known = np.isfinite(rough)
    if not known.any():
        return []
    r = neighbour_correlation(rough)
    # A window's mean takes part of the noise along: that of the pixels that share one error.
    shared = 1.0 if not r > 0.05 else 2 * math.pi * length_of(r) ** 2
    grown = 1 / math.sqrt(max(0.3, 1 - shared / WINDOW_PX**2))
    z, tangent, rough = errors.depth[known], errors.tangent[known], rough[known]
    depth_bin = np.floor(np.log(z) / math.log(STEP)).astype(int)
    angle_bin = np.digitize(np.degrees(np.arctan(tangent)), BINS_DEG)
    out = []
    for key in np.unique(100 * depth_bin + angle_bin):
        here = 100 * depth_bin + angle_bin == key
        if here.sum() < ENOUGH:
            continue
        sd = grown * float(np.sqrt(np.mean(rough[here] ** 2)))
        out.append(
            NoiseSample(float(np.median(z[here])), float(np.median(tangent[here])), sd, int(here.sum()))
        )
    return out


def length_of(neighbours: float) -> float:
    """The length (px) for which exp(-d^2 / (2 length^2)) equals `neighbours` at d = 1."""
    return math.sqrt(-1 / (2 * math.log(min(max(neighbours, 1e-9), 0.999))))


def fit_noise(samples: list[NoiseSample]) -> tuple[float, float, float]:
    """(noise_m, noise_per_m, noise_incidence), each >= 0: least squares of ln sd."""
    z, t, sd = (np.array([s[k] for s in samples]) for k in range(3))
    weight = np.sqrt(np.array([min(s.readings, 20000) for s in samples], np.float64))
    free = [True, z.max() > SPAN * z.min(), t.max() > 0.4 and np.ptp(t) > 0.3]
    x = np.log([np.median(sd) * 0.7, *([np.median(sd / z**2) * 0.3] * 1), np.median(sd / z) * 0.3])
    x[[k for k in range(3) if not free[k]]] = -50.0
    damping = 1e-2
    best = _misfit(x, z, t, sd, weight)
    for _ in range(ROUNDS):
        r = _residual(x, z, t, sd, weight)
        J = np.zeros((len(z), 3))
        for k in range(3):
            if free[k]:
                step = np.zeros(3)
                step[k] = 1e-5
                J[:, k] = (_residual(x + step, z, t, sd, weight) - r) / 1e-5
        H = J.T @ J
        d = np.linalg.lstsq(H + damping * np.diag(np.diag(H)) + 1e-9 * np.eye(3), -J.T @ r, rcond=None)[0]
        trial = np.clip(x + np.clip(d, -2, 2), -50, 2)
        now = _misfit(trial, z, t, sd, weight)
        if now < best:
            x, best, damping = trial, now, damping / 3
        else:
            damping *= 5
    values = np.where(np.exp(x) > MIN_M, np.exp(x), 0.0)
    return float(values[0]), float(values[1]), float(values[2])


def _residual(x: Array, z: Array, t: Array, sd: Array, weight: Array) -> Array:
    a, b, c = np.exp(x)
    residual: Array = weight * (np.log(np.hypot(a + b * z**2, c * z * t)) - np.log(sd))
    return residual


def _misfit(x: Array, z: Array, t: Array, sd: Array, weight: Array) -> float:
    return float((_residual(x, z, t, sd, weight) ** 2).sum())


def fit_growth(z: Array, value: Array, signed: bool) -> tuple[float, float]:
    """Robust fit of (constant, per Z^2) to values over distance; the growth is 0 if the range is too small.

    Unless `signed`, both are at least 0.
    """
    A = np.column_stack([np.ones(len(z)), z**2])
    if not z.max() > SPAN * z.min():
        return float(np.median(value)), 0.0
    x = np.linalg.lstsq(A, value, rcond=None)[0]
    for _ in range(10):
        r = np.abs(value - A @ x)
        w = 1 / np.maximum(r, max(1e-9, 0.3 * float(np.median(r))))
        x = np.linalg.lstsq(A * w[:, None] ** 0.5, value * w**0.5, rcond=None)[0]
    if not signed and x[0] < 0:
        return 0.0, max(0.0, float(np.median(value / z**2)))
    if not signed and x[1] < 0:
        return max(0.0, float(np.median(value))), 0.0
    return float(x[0]), float(x[1])
