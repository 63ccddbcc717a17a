# SPDX-License-Identifier: MIT
"""The connected region of a depth image around a pixel."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.imaging.plane import remove_plane

__all__ = ["connected_region", "nearest_reading"]

# A larger difference between neighbours is an edge: noise, and a surface that is seen at 76 degrees.
STEP, STEP_PX = 0.012, 4.0  # of the depth, and of a pixel's width there
NEAR_PX = 4  # a click on a hole is taken for the nearest measurement this near
MIN_PX = 20
PLANE_M = 0.008  # half thickness of what counts as the table


def connected_region(frame: Any, camera: Any, px: tuple[float, float], reach_m: float) -> NDArray[np.bool_]:
    """Pixels connected to `px` without a depth discontinuity, within `reach_m`, and not on the dominant plane.

    Parameters
    ----------
    frame : Frame
        With a depth image.
    camera : Camera or RGBDCamera
        Of the depth image.
    px : (x, y)
        Depth pixels.
    reach_m : float
        Largest distance of the object's points from the one at `px`, m: the object's diameter.

    Returns
    -------
    (H, W) bool

    Raises
    ------
    ValueError
        No depth at or near `px`, or almost no connected pixels there.
    """
    import cv2

    seed = nearest_reading(frame, px)
    points = depth_camera(camera).back_project(frame.depth)
    near = np.linalg.norm(points - points[seed], axis=-1) <= reach_m
    near &= frame.depth > 0
    with contextlib.suppress(ValueError):  # no plane: nothing to leave out
        off_plane = remove_plane(frame, camera, tolerance=PLANE_M, threads=1)[0]
        if off_plane[seed]:
            near &= off_plane
    blocked = np.ones((near.shape[0] + 2, near.shape[1] + 2), np.uint8)
    blocked[1:-1, 1:-1] = ~near
    before = blocked.copy()
    step = float(frame.depth[seed]) * (STEP + STEP_PX / depth_camera(camera).fx)
    cv2.floodFill(
        np.array(frame.depth), blocked, seed[::-1], 0.0, step, step, 8 | cv2.FLOODFILL_MASK_ONLY | (2 << 8)
    )
    region: NDArray[np.bool_] = (blocked != before)[1:-1, 1:-1]
    if np.count_nonzero(region) < MIN_PX:
        raise ValueError(
            f"expected a surface, got only {np.count_nonzero(region)} connected pixels; click on the centre of "
            "the object"
        )
    return region


def nearest_reading(frame: Any, px: tuple[float, float]) -> tuple[int, int]:
    """(row, column) of the measurement at `px` or next to it; ValueError if there is none."""
    if frame.depth is None:
        raise ValueError(f"expected a depth image, got none{': ' + frame.error if frame.error else ''}")
    depth = frame.depth
    x, y = round(px[0]), round(px[1])
    top, left = max(0, y - NEAR_PX), max(0, x - NEAR_PX)
    v, u = np.nonzero(depth[top : y + NEAR_PX + 1, left : x + NEAR_PX + 1])
    if not len(v):
        raise ValueError(
            f"expected a depth measurement at ({x}, {y}), got none there; click on the object itself"
        )
    nearest = int(np.argmin((v + top - y) ** 2 + (u + left - x) ** 2))
    return int(v[nearest]) + top, int(u[nearest]) + left
