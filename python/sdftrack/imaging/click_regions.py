# SPDX-License-Identifier: MIT
"""Candidate regions for a click: segmentations around it by depth, by colour, and by both; regions grown in depth."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import RGBDCamera, depth_camera
from sdftrack.imaging.near_planes import planes_near, tolerance_m
from sdftrack.imaging.plane import remove_plane

Mask = NDArray[np.bool_]

AROUND = 2.5  # times the object's size: the surroundings that planes are looked for in
STEP, STEP_PX = 0.008, 3.0  # a step in depth, of the depth and of a pixel's width there, is an edge
SMOOTH_STEP = 0.4  # the same, for objects that touch: stricter
CUT_ROUNDS = 4
CUT_PX = 200  # longest side of the window that colours are cut in
MIN_SHARE = 0.2  # of what hangs together by depth, that colours leave of it at least
SEED_PX, SEED_M = 3, 0.01  # about the click, what surely is the object


def click_regions(frame: Any, camera: Any, px: tuple[float, float], size_m: float) -> list[Mask]:
    """Candidate regions (H, W) of the object around a click, most likely first; planes are excluded.

    `px` (x, y) are depth pixels, `size_m` is the largest distance between two points of the object. Colours are used if
    available. ValueError without depth near `px`, with `px` on a plane larger than the object, or without a connected
    region.
    """
    whole = nearest_reading(frame, px)
    pinhole = depth_camera(camera)
    window = _window(pinhole, frame.depth, whole, AROUND * size_m)
    seed = whole[0] - window[0].start, whole[1] - window[1].start
    depth = np.ascontiguousarray(frame.depth[window])
    points = pinhole.back_project(frame.depth)[window]
    distance = np.linalg.norm(points - points[seed], axis=-1)
    read = np.asarray(depth > 0)
    near = read & (distance <= size_m)
    free, clicked = near.copy(), seed
    for plane in planes_near(points, read, read & (distance < AROUND * size_m), size_m):
        free &= ~plane.pixels
        if plane.pixels[clicked]:
            table = plane
    if not free[clicked]:  # the foot of an object, or the table beside it
        beside = _nearest(free, points, clicked)
        if beside is None:
            raise ValueError(
                f"expected a pixel of the object, got ({px[0]:g}, {px[1]:g}) on a plane that extends over "
                f"{table.extent_m:.2f} m (a table, a wall); click on the centre of the object"
            )
        seed = beside
    z, step = float(depth[seed]), STEP + STEP_PX / pinhole.fx  # of the depth
    joined = _joined(depth, free, seed, z * step)
    regions = [joined, _joined(depth, free, seed, SMOOTH_STEP * z * step)]
    rgb = registered_colors(frame, camera)
    if rgb is not None:
        cut = _cut(np.ascontiguousarray(rgb[window]), near, free, joined, points, seed)
        if cut is not None:
            regions.append(_joined(depth, cut, seed, 2.0 * z * step))
    least = max(MIN_PX, MIN_SHARE * np.count_nonzero(joined))
    kept: list[Mask] = []
    for region in regions:
        if np.count_nonzero(region) >= least and not any(np.array_equal(region, k[window]) for k in kept):
            kept.append(np.zeros(frame.depth.shape, bool))
            kept[-1][window] = region
    if not kept:
        raise ValueError(TOO_SMALL.format(np.count_nonzero(joined)))
    return kept


def _nearest(free: Mask, points: NDArray[np.float64], clicked: tuple[int, int]) -> tuple[int, int] | None:
    """The pixel of `free` nearest to the clicked one, if it is within a plane's thickness."""
    v, u = np.nonzero(free)
    if not len(v):
        return None
    apart = np.linalg.norm(points[v, u] - points[clicked], axis=1)
    k = int(np.argmin(apart))
    thickness = 2 * float(tolerance_m(points[clicked][2]))
    return (int(v[k]), int(u[k])) if apart[k] < thickness else None


def _window(
    camera: Any, depth: NDArray[np.float32], seed: tuple[int, int], reach_m: float
) -> tuple[slice, slice]:
    """Rows and columns that contain everything within `reach_m` of the seed."""
    z = float(depth[seed])
    far = reach_m / max(z - 0.5 * reach_m, 0.5 * z)
    rows, columns = int(far * camera.fy) + 1, int(far * camera.fx) + 1
    return (
        slice(max(0, seed[0] - rows), min(depth.shape[0], seed[0] + rows + 1)),
        slice(max(0, seed[1] - columns), min(depth.shape[1], seed[1] + columns + 1)),
    )


def registered_colors(frame: Any, camera: Any) -> NDArray[np.uint8] | None:
    """The colour of every depth pixel, (H, W, 3); black if unknown; None without a colour image."""
    if frame.color is None:
        return None
    if not isinstance(camera, RGBDCamera) or camera.aligned:
        same = frame.color.shape[:2] == frame.depth.shape
        return np.ascontiguousarray(frame.color) if same else None
    v, u = np.nonzero(frame.depth > 0)
    at = camera.project_to_color(camera.depth.back_project(frame.depth)[v, u])
    height, width = frame.color.shape[:2]
    with np.errstate(invalid="ignore"):
        inside = (at >= -0.5).all(axis=1) & (at[:, 0] < width - 0.5) & (at[:, 1] < height - 0.5)
    x, y = np.rint(at[inside]).astype(int).T
    out = np.zeros((*frame.depth.shape, 3), np.uint8)
    out[v[inside], u[inside]] = frame.color[y, x]
    return out


def _joined(depth: NDArray[np.float32], free: Mask, seed: tuple[int, int], step: float) -> Mask:
    """Pixels of `free` connected to `seed` without a larger step in depth, m."""
    import cv2

    if not free[seed]:
        return np.zeros(depth.shape, bool)
    blocked = np.ones((depth.shape[0] + 2, depth.shape[1] + 2), np.uint8)
    blocked[1:-1, 1:-1] = ~free
    before = blocked.copy()
    flags = 8 | cv2.FLOODFILL_MASK_ONLY | (2 << 8)
    cv2.floodFill(np.array(depth), blocked, seed[::-1], 0.0, step, step, flags)
    return (blocked != before)[1:-1, 1:-1]


def _cut(
    rgb: NDArray[np.uint8],
    near: Mask,
    free: Mask,
    joined: Mask,
    points: NDArray[np.float64],
    seed: tuple[int, int],
) -> Mask | None:
    """Segmentation of `free` by colour: GrabCut, initialised with the connected region."""
    import cv2

    rows, columns = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    margin = 8
    y0, y1 = max(0, rows[0] - margin), rows[-1] + 1 + margin
    x0, x1 = max(0, columns[0] - margin), columns[-1] + 1 + margin
    every = max(1, round(max(y1 - y0, x1 - x0) / CUT_PX))
    window = (slice(y0, y1, every), slice(x0, x1, every))
    labels = np.full(near[window].shape, cv2.GC_PR_BGD, np.uint8)
    labels[~free[window]] = cv2.GC_BGD
    labels[joined[window]] = cv2.GC_PR_FGD
    v, u = np.mgrid[: near.shape[0], : near.shape[1]]
    sure = (np.hypot(v - seed[0], u - seed[1]) <= max(SEED_PX, every)) & joined
    sure &= np.abs(points[..., 2] - points[seed][2]) < SEED_M
    labels[sure[window]] = cv2.GC_FGD
    if not (labels == cv2.GC_FGD).any() or not (labels == cv2.GC_BGD).any():
        return None
    picture = np.ascontiguousarray(cv2.GaussianBlur(rgb, (3, 3), 0)[window])
    inner, outer = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.setRNGSeed(0)
    cv2.grabCut(picture, labels, (0, 0, 1, 1), outer, inner, CUT_ROUNDS, cv2.GC_INIT_WITH_MASK)
    inside = np.zeros(near.shape, np.uint8)
    small = ((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)).astype(np.uint8)
    large = np.repeat(np.repeat(small, every, axis=0), every, axis=1)[: y1 - y0, : x1 - x0]
    inside[y0 : y0 + large.shape[0], x0 : x0 + large.shape[1]] = large[
        : near.shape[0] - y0, : near.shape[1] - x0
    ]
    return (inside > 0) & free | sure


# -- The connected region of a depth image around a pixel


# A larger difference between neighbours is an edge: noise, and a surface that is seen at 76 degrees.
GROWTH_STEP, GROWTH_STEP_PX = 0.012, 4.0  # of the depth, and of a pixel's width there
NEAR_PX = 4  # a click on a hole is taken for the nearest measurement this near
ALONE_M, ALONE_PX = 0.02, 13  # an island among holes has fewer at its distance within 2 px
MIN_PX = 20
TOO_SMALL = "expected a surface, got only {} connected pixels; click on the centre of the object"
PLANE_M = 0.008  # half thickness of what counts as the table


def connected_region(frame: Any, camera: Any, px: tuple[float, float], reach_m: float) -> NDArray[np.bool_]:
    """Pixels connected to `px` without a depth discontinuity, within `reach_m`, and not on the dominant plane.

    `px` (x, y) are depth pixels, `reach_m` is the object's diameter. ValueError without depth at or near `px`, or with
    almost no connected pixels there.
    """
    seed = nearest_reading(frame, px)
    points = depth_camera(camera).back_project(frame.depth)
    near = (np.linalg.norm(points - points[seed], axis=-1) <= reach_m) & (frame.depth > 0)
    with contextlib.suppress(ValueError):  # no plane: nothing to leave out
        off_plane = remove_plane(frame, camera, tolerance=PLANE_M, threads=1)[0]
        if off_plane[seed]:
            near &= off_plane
    step = float(frame.depth[seed]) * (GROWTH_STEP + GROWTH_STEP_PX / depth_camera(camera).fx)
    region = _joined(frame.depth, near, seed, step)
    if np.count_nonzero(region) < MIN_PX:
        raise ValueError(TOO_SMALL.format(np.count_nonzero(region)))
    return region


def nearest_reading(frame: Any, px: tuple[float, float]) -> tuple[int, int]:
    """(row, column) of the measurement at `px`, else next to it, with others around it; ValueError if there is none."""
    if frame.depth is None:
        raise ValueError(f"expected a depth image, got none{': ' + frame.error if frame.error else ''}")
    x, y = round(px[0]), round(px[1])
    top, left = max(0, y - NEAR_PX), max(0, x - NEAR_PX)
    v, u = np.nonzero(frame.depth[top : y + NEAR_PX + 1, left : x + NEAR_PX + 1])
    if not len(v):
        raise ValueError(
            f"expected a depth measurement at ({x}, {y}), got none there; click on the object itself"
        )
    v, u = v + top, u + left
    z, apart = frame.depth[v, u], (v - y) ** 2 + (u - x) ** 2
    beside = np.maximum(np.abs(v[:, None] - v), np.abs(u[:, None] - u)) <= 2
    poor = (beside & (np.abs(z[:, None] - z) < ALONE_M)).sum(axis=1) < ALONE_PX
    poor |= np.abs(z - z[np.argmin(apart)]) > 2 * ALONE_M  # of another surface
    nearest = int(np.argmin(apart + poor * (3 * NEAR_PX) ** 2))
    return int(v[nearest]), int(u[nearest])
