# SPDX-License-Identifier: MIT
"""Back-projection of depth images to points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.camera import Camera, RGBDCamera, depth_camera

__all__ = ["back_project"]


def back_project(
    depth: ArrayLike, camera: Camera | RGBDCamera, mask: ArrayLike | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Back-project the valid pixels of a depth image to points.

    Parameters
    ----------
    depth : (H, W) float, m, 0 or NaN = no measurement
    camera : Camera or RGBDCamera
    mask : (H, W) bool, optional
        False: omit the pixel.

    Returns
    -------
    points : (N, 3) float64
        Camera frame, m: ``depth * K^-1 (x, y, 1)``, distortion removed.
    pixels : (N, 2) int64
        (x, y) of each point.

    Raises
    ------
    ValueError
        The size of `depth` or `mask` differs from the camera's.
    """
    pinhole = depth_camera(camera)
    z = np.asarray(depth)
    points = pinhole.back_project(z)
    valid = np.isfinite(z) & (z > 0)
    if mask is not None:
        chosen = np.asarray(mask)
        if chosen.shape != z.shape:
            raise ValueError(f"mask: expected shape {z.shape} as depth, got {chosen.shape}")
        valid &= chosen != 0
    y, x = np.nonzero(valid)
    return np.ascontiguousarray(points[y, x], dtype=np.float64), np.stack([x, y], axis=1)
