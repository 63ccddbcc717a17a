# SPDX-License-Identifier: MIT
"""Misfit of a known shape to the measurements over the image, before and after a calibration."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.calibration.intrinsics_result import COLUMNS, MIN_IN_CELL, ROWS, IntrinsicsResult
from sdftrack.calibration.lens import EXTRA
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame, as_given
from sdftrack.io.report_file import plain
from sdftrack.results import Status
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker

Array = NDArray[np.float64]

SHOWN_FRAMES = 12  # of those that the calibration used, evenly chosen
NEAR_M = 0.03  # measurements farther from the surface are of other things
POOR_LENS_NOISE_M = 0.006  # a tracker that forgives a lens which is 10 % off


@dataclass(frozen=True, eq=False)
class Misfit:
    """Median absolute distance of measurements from the shape's surface for one camera, from `frames` frames.

    `cells_m` (6, 8) is that in each cell of the image, rows from the top; NaN with fewer than 50 measurements.
    """

    median_m: float
    cells_m: Array
    frames: int

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain values, None where unknown."""
        return dict(plain(dataclasses.asdict(self)))


class Frames(Protocol):
    """A list of frames, or anything that is indexed like one."""

    def __getitem__(self, i: int, /) -> Frame: ...


def compare(
    frames: Frames, sdf: SDF, first: Camera | RGBDCamera, result: IntrinsicsResult, threads: int = 0
) -> tuple[Misfit, Misfit]:
    """Misfit for the initial and the calibrated camera, on the same frames.

    A dozen of the calibration's `frames` are read. The poses are optimised for each camera: those of the calibrated one
    are the result's; for the initial one the object is refitted from the same pixels.
    """
    guess = depth_camera(first, "first")
    tracker = Tracker(sdf, guess, mode="depth", threads=threads, noise_m=POOR_LENS_NOISE_M)
    before, after = [], []
    chosen = np.unique(np.linspace(0, len(result.frames) - 1, SHOWN_FRAMES).round().astype(int))
    middle_obj = sdf.bounds.mean(axis=0)
    for m in chosen:
        depth = as_given(frames[result.frames[m]]).depth
        if depth is None:
            continue
        T = result.poses[m]
        after.append(_readings(depth, sdf, result.camera, T, result.extra))
        start = _as_seen_by(guess, result.camera, T, middle_obj)
        fitted = tracker.start(Frame(depth, check_units=False), start)
        if fitted.status[0] in (Status.OK, Status.WEAK):
            before.append(_readings(depth, sdf, guess, fitted.poses[0]))
    return misfit(before, guess), misfit(after, guess)


def misfit(readings: Sequence[tuple[NDArray[Any], Array]], camera: Camera) -> Misfit:
    """Misfit from the measurements of several frames: pixels (N, 2) and distances (N,), m, of each."""
    if not readings:
        return Misfit(float("nan"), np.full((ROWS, COLUMNS), np.nan), 0)
    pixels = np.concatenate([px for px, _ in readings])
    sizes = np.abs(np.concatenate([r for _, r in readings]))
    column = pixels[:, 0] * COLUMNS // camera.width
    row = pixels[:, 1] * ROWS // camera.height
    cells = np.full((ROWS, COLUMNS), np.nan)
    for v in range(ROWS):
        for u in range(COLUMNS):
            inside = sizes[(column == u) & (row == v)]
            if len(inside) >= MIN_IN_CELL:
                cells[v, u] = np.median(inside)
    return Misfit(float(np.median(sizes)) if len(sizes) else float("nan"), cells, len(readings))


def points_of(depth: NDArray[np.float32], camera: Camera, extra: dict[str, float] | None = None) -> Array:
    """(H, W, 3) points, m, with parameters not in Camera; (0, 0, 0) without a measurement."""
    # `extra`: skew (px), depth_scale, depth_offset (m), see `IntrinsicsResult.extra`.
    values = {**EXTRA, **(extra or {})}
    depth_m = np.where(depth > 0, values["depth_scale"] * depth + values["depth_offset"], 0.0)
    if values["skew"] == 0:
        return camera.back_project(depth_m)
    return _rays(camera, values["skew"]) * depth_m[..., None]


def _rays(camera: Camera, skew: float) -> Array:
    """(H, W, 3) rays, z = 1, of a camera with skew: each row is that of a camera without skew, with shifted centre."""
    rays = np.ones((*camera.shape, 3))
    for v in range(camera.height):
        cx = camera.cx + skew * (v - camera.cy) / camera.fy
        row = _core.Camera(camera.fx, camera.fy, cx, camera.cy - v, camera.width, 1, list(camera.distortion))
        rays[v, :, :2] = row.rays()[0]
    return rays


def _readings(
    depth: NDArray[np.float32],
    sdf: SDF,
    camera: Camera,
    T_cam_obj: Array,
    extra: dict[str, float] | None = None,
) -> tuple[NDArray[Any], Array]:
    """Pixels (N, 2) within the object's outline, and signed distances of the measurements to its surface (m)."""
    v, u = np.nonzero(sdf.silhouette(camera, T_cam_obj) & (depth > 0))
    p_cam = points_of(depth, camera, extra)[v, u]
    outside_m = sdf((p_cam - T_cam_obj[:3, 3]) @ T_cam_obj[:3, :3])
    near = np.abs(outside_m) < NEAR_M
    return np.column_stack([u, v])[near], outside_m[near]


def _as_seen_by(camera: Camera, other: Camera, T_other_obj: Array, middle_obj: Array) -> Array:
    """The pose shifted laterally, so that `camera` sees the object's centre at the same pixel as `other`."""
    middle = T_other_obj[:3, :3] @ middle_obj + T_other_obj[:3, 3]
    u, v = other.project(middle)
    z = middle[2]
    T = T_other_obj.copy()
    # The lens bends by far less than the two cameras differ: the pinhole will do for a start.
    seen_m = np.array([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z])
    T[:3, 3] += seen_m - middle
    return T
