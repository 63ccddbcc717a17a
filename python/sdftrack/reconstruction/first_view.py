# SPDX-License-Identifier: MIT
"""Bounds on the object from the first frame: within its silhouette cone and above its supporting planes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.imaging.regions import NearPlane, planes_near

WINDOW_PX = 200  # along the surroundings, that are enough for a plane
AROUND = 2.5  # times the object's size: the surroundings that planes are looked for in
ABOVE = 0.9  # of the mask's measurements lie above a plane that the object stands on or before
THIN_M, PER_SD = 0.002, 2.0  # half thickness of a plane: so many sd of its own measurements, at least 2 mm
ALIKE, CLOSE_M = 0.97, 0.04  # cosine and distance of planes of which the one behind is enough
MAD_TO_SD = 1.48
OWN_SHARE = 0.2  # of a mask's measurements, that planes leave at least
NOT_HIDDEN, IN_MARGIN = np.float32(np.inf), np.float32(1e-3)  # m

Mask = NDArray[np.bool_]
Array = NDArray[np.float64]


@dataclass(frozen=True)
class FirstView:
    """The region that can contain the object, in the first camera's frame.

    `from_m` (H, W): minimum depth of the object along each pixel's ray: 0 in the mask, 1 mm in the margin around it,
    infinite where the object cannot be. `planes` (N, 5): normal towards the camera, offset (m) and half thickness (m)
    of each; the object is above.
    """

    from_m: NDArray[np.float32]
    planes: Array

    def to_core(self, camera: Camera, T_cam_obj: Array, middle: Array, radius_m: float) -> Any:
        """`middle` (camera frame) and `radius_m`: approximate location of the object."""
        return _core.FirstView(camera._core, T_cam_obj, self.from_m, self.planes, middle.tolist(), radius_m)


def own_pixels(depth: NDArray[np.float32], on_object: Mask, camera: Camera, planes: Array) -> Mask:
    """(H, W), the object's pixels without those on planes; ValueError if these are nearly all of the mask."""
    free = on_object & above(depth, camera, planes)
    before, after = (np.count_nonzero(m & (depth > 0)) for m in (on_object, free))
    if after < OWN_SHARE * before:
        raise ValueError(
            f"mask: expected an object, got a plane that extends beyond it ({100 - 100 * after / before:.0f} % of its "
            "depth measurements lie on a table or a wall); give the object's mask, or planes=False if it is that flat"
        )
    return free


def above(depth: NDArray[np.float32], camera: Camera, planes: Array) -> Mask:
    """(H, W), the pixels whose measurement is above all planes (beyond their thickness), or that have none."""
    points = camera.back_project(depth)
    free = np.ones(depth.shape, bool)
    for plane in planes:
        free &= (depth <= 0) | (points @ plane[:3] + plane[3] >= plane[4])
    return free


def room(depth: NDArray[np.float32], on_object: Mask, outline: Mask, margin_px: int) -> NDArray[np.float32]:
    """``FirstView.from_m`` from the object's pixels in the first frame and its outline (a mask, a box).

    Within the outline at any depth; outside it only behind a possible occluder.
    """
    import cv2

    size = 2 * margin_px + 1
    grown = cv2.dilate(outline.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    middle = float(np.median(depth[on_object & (depth > 0)]))
    hides = (depth > 0) & (depth < middle)
    from_m = np.where(hides, depth, NOT_HIDDEN)
    from_m[grown] = IN_MARGIN
    from_m[outline] = 0
    return from_m.astype(np.float32)


def planes_below(
    depth: NDArray[np.float32], on_object: Mask, camera: Camera, size_m: float, *, among: bool = False
) -> Array:
    """Planes around the object that are larger than it, and that it is above: (N, 5) as in `FirstView`.

    `among`: they may be visible among its pixels, which come from a box.
    """
    read, points = depth > 0, camera.back_project(depth)
    mine = points[on_object & read]
    middle = np.median(mine, axis=0)
    around = read & (among | ~on_object) & (np.linalg.norm(points - middle, axis=-1) < AROUND * size_m)
    ys, xs = np.nonzero(around)
    if not len(ys):
        return np.zeros((0, 5))
    (y0, y1), (x0, x1) = ((int(at.min()), int(at.max()) + 1) for at in (ys, xs))
    step = max(1, max(y1 - y0, x1 - x0) // WINDOW_PX)
    window = slice(y0, y1, step), slice(x0, x1, step)
    rows = [_row(plane, points[window]) for plane in planes_near(depth, camera, around, size_m, window)]
    kept = [row for row in rows if np.mean(mine @ row[:3] + row[3] > -row[4]) > ABOVE]
    return np.array(_without_doubles(kept, middle)).reshape(-1, 5)


def _without_doubles(rows: list[Array], middle: Array) -> list[Array]:
    """A table bent by lens distortion is found as several planes: only the one farthest below the object is kept."""
    rows = sorted(rows, key=lambda row: -float(row[:3] @ middle + row[3]))
    kept: list[Array] = []
    for row in rows:
        height = row[:3] @ middle + row[3]
        if not any(row[:3] @ k[:3] > ALIKE and k[:3] @ middle + k[3] - height < CLOSE_M for k in kept):
            kept.append(row)
    return kept


def _row(plane: NearPlane, points: Array) -> Array:
    heights = points[plane.pixels] @ plane.normal + plane.offset
    offset = plane.offset - float(np.median(heights))
    sd = MAD_TO_SD * float(np.median(np.abs(heights - np.median(heights))))
    return np.array([*plane.normal, offset, max(THIN_M, PER_SD * sd)])
