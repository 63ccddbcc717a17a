# SPDX-License-Identifier: MIT
"""What stands out of the planes of a frame and is of about an object's size: where an object may be."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.imaging.near_planes import planes_near, surface_normals

__all__ = ["standing_regions"]

Mask = NDArray[np.bool_]

PIXELS = 320  # along the longer side of the image that is looked at
STEP, STEP_PX = 0.015, 3.0  # a step in depth, of the depth and of a pixel's width there, is an edge
LEAST, MOST = 0.3, 1.4  # of the object's size: what a thing reaches over
LIKELY = 0.8  # of it, what is mostly seen
LEAST_PX = 40  # of the thinned out image
ENDS = (0.03, 0.97)


def standing_regions(frame: Any, camera: Any, size_m: float, most: int = 12) -> list[Mask]:
    """Regions without planes, parted by steps in depth, of an object's size; the likeliest sizes first.

    Parameters
    ----------
    frame : Frame
        With a depth image.
    camera : Camera or RGBDCamera
    size_m : float
        Largest extent of the object.
    most : int

    Returns
    -------
    list of (H, W) bool
        Of every pixel of the depth image, though only every second or third is looked at.
    """
    import cv2

    every = max(1, max(frame.depth.shape) // PIXELS)
    depth = np.ascontiguousarray(frame.depth[::every, ::every])
    points = depth_camera(camera).back_project(frame.depth)[::every, ::every]
    read = depth > 0
    free = read.copy()
    for plane in planes_near(points, surface_normals(points, read), read, size_m):
        free &= ~plane.pixels
    free &= ~_edges(depth, every / depth_camera(camera).fx)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(free.astype(np.uint8), connectivity=4)
    found: list[tuple[float, Mask]] = []
    for k in range(1, count):
        if stats[k, cv2.CC_STAT_AREA] < LEAST_PX:
            continue
        region = labels == k
        reach = _reach(points[region])
        if LEAST * size_m < reach < MOST * size_m:
            found.append((abs(float(np.log(reach / (LIKELY * size_m)))), region))
    found.sort(key=lambda f: f[0])
    return [_enlarged(region, every, frame.depth) for _, region in found[:most]]


def _edges(depth: NDArray[np.float32], px: float) -> Mask:
    """The farther pixel of each step between neighbours."""
    edge = np.zeros(depth.shape, bool)
    for axis in (0, 1):
        step = np.diff(depth, axis=axis)
        low = np.minimum(
            np.take(depth, range(depth.shape[axis] - 1), axis),
            np.take(depth, range(1, depth.shape[axis]), axis),
        )
        steep = np.abs(step) > low * (STEP + STEP_PX * px)
        first, second = (slice(None, -1), slice(1, None))
        before = (first, slice(None)) if axis == 0 else (slice(None), first)
        after = (second, slice(None)) if axis == 0 else (slice(None), second)
        edge[before] |= steep & (step < 0)
        edge[after] |= steep & (step > 0)
    return edge


def _reach(p: NDArray[np.float64]) -> float:
    along = np.linalg.eigh(np.cov(p.T))[1][:, 2]
    low, high = np.quantile(p @ along, ENDS)
    return float(high - low)


def _enlarged(region: Mask, every: int, depth: NDArray[np.float32]) -> Mask:
    whole = np.repeat(np.repeat(region, every, axis=0), every, axis=1)[: depth.shape[0], : depth.shape[1]]
    out: Mask = np.zeros(depth.shape, bool)
    out[: whole.shape[0], : whole.shape[1]] = whole
    return out & (depth > 0)
