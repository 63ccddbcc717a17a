# SPDX-License-Identifier: MIT
"""Errors of a depth image relative to a known surface: the largest plane in it, or a known object at a known pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.camera import Camera
from sdftrack.frame import Frame

__all__ = ["DepthErrors", "errors_of_object", "errors_of_plane", "rough_part", "smooth_part"]

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
