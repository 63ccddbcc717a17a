# SPDX-License-Identifier: MIT
"""Candidate regions for an object: regions above the planes of a frame with about the object's size."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.imaging.near_planes import planes_near

Mask = NDArray[np.bool_]

PIXELS = 320  # along the longer side of the image that is looked at
STEP, STEP_PX = 0.015, 3.0  # a step in depth, of the depth and of a pixel's width there, is an edge
MIN_REACH, MAX_REACH = 0.3, 1.4  # of the object's size: what a thing reaches over
LIKELY = 0.8  # of it, what is mostly seen
MIN_PX = 40  # of the thinned out image
ENDS = (0.03, 0.97)
GAPS = (0.03, 0.06, 0.12)  # of the object's size: across holes between pieces of one thing
JOIN_POINTS = 200  # of a piece, that are looked at for that
APART = 0.7  # of the object's size, between pixels of larger things


class Standing(NamedTuple):
    """Regions of about the object's size, and pixels (x, y) in larger ones, which may contain the object."""

    regions: list[Mask]
    pixels: list[tuple[int, int]]


def standing_regions(frame: Any, camera: Any, size_m: float, most: int = 12) -> Standing:
    """At most `most` regions without planes, separated by depth discontinuities; likeliest sizes, nearest pixels first.

    Pieces that lie together, parted by holes of the sensor, are a region of their own as well. `size_m` is the largest
    extent of the object.
    """
    import cv2

    every = max(1, max(frame.depth.shape) // PIXELS)
    depth = np.ascontiguousarray(frame.depth[::every, ::every])
    points = depth_camera(camera).back_project(frame.depth)[::every, ::every]
    read = depth > 0
    free = read.copy()
    for plane in planes_near(points, read, read, size_m):
        free &= ~plane.pixels
    free &= ~_edges(depth, every / depth_camera(camera).fx)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(free.astype(np.uint8), connectivity=4)
    found: list[tuple[float, Mask]] = []
    large = np.zeros(depth.shape, bool)
    pieces: list[Mask] = []

    def consider(region: Mask) -> float:
        reach = _reach(points[region])
        if MIN_REACH * size_m < reach < MAX_REACH * size_m:
            found.append((abs(float(np.log(reach / (LIKELY * size_m)))), region))
        return reach

    for k in range(1, count):
        if stats[k, cv2.CC_STAT_AREA] < MIN_PX:
            continue
        region = labels == k
        reach = consider(region)
        if reach >= MAX_REACH * size_m:
            large |= region
        else:
            pieces.append(region)
    seen: set[bytes] = set()
    for gap in GAPS:
        for group in _joined(pieces, points, gap * size_m):
            if group.tobytes() not in seen:
                seen.add(group.tobytes())
                consider(group)
    found.sort(key=lambda f: f[0])
    pixels = [(every * u, every * v) for u, v in _spread(large, points, APART * size_m, most)]
    return Standing([_enlarged(region, every, frame.depth) for _, region in found[:most]], pixels)


def _joined(pieces: list[Mask], points: NDArray[np.float64], gap_m: float) -> list[Mask]:
    """Unions of two or more pieces whose points come nearer to one another than `gap_m`: holes have parted them."""
    from scipy import sparse
    from scipy.spatial import cKDTree

    trees = [cKDTree(points[piece][:: max(1, int(piece.sum()) // JOIN_POINTS)]) for piece in pieces]
    near = np.zeros((len(pieces), len(pieces)), bool)
    for i, one in enumerate(trees):
        for j in range(i):
            near[i, j] = one.count_neighbors(trees[j], gap_m) > 0
    _, group = sparse.csgraph.connected_components(sparse.csr_matrix(near), directed=False)
    return [
        np.any([pieces[i] for i in np.flatnonzero(group == k)], axis=0)
        for k in np.unique(group)
        if np.count_nonzero(group == k) > 1
    ]


def _spread(large: Mask, points: NDArray[np.float64], apart_m: float, most: int) -> list[tuple[int, int]]:
    """Pixels (x, y) with mutually distant points, each the nearest remaining one to the camera."""
    import cv2

    v, u = np.nonzero(cv2.erode(large.astype(np.uint8), np.ones((3, 3), np.uint8)))
    p = points[v, u]
    order = np.argsort(p[:, 2], kind="stable")
    v, u, p = v[order], u[order], p[order]
    left = np.ones(len(p), bool)
    chosen: list[tuple[int, int]] = []
    while left.any() and len(chosen) < most:
        k = int(np.argmax(left))
        near = np.linalg.norm(p - p[k], axis=1) < apart_m
        middle = p[near & left].mean(axis=0)
        k = int(np.argmin(np.linalg.norm(p - middle, axis=1)))
        chosen.append((int(u[k]), int(v[k])))
        left &= ~near
    return chosen


def _edges(depth: NDArray[np.float32], px: float) -> Mask:
    """The farther pixel at each depth discontinuity between neighbours."""
    edge = np.zeros(depth.shape, bool)
    for z, on_edge in ((depth, edge), (depth.T, edge.T)):
        step = np.diff(z, axis=0)
        steep = np.abs(step) > np.minimum(z[:-1], z[1:]) * (STEP + STEP_PX * px)
        on_edge[:-1] |= steep & (step < 0)
        on_edge[1:] |= steep & (step > 0)
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
