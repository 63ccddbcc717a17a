# SPDX-License-Identifier: MIT
"""Segmentation of the object in a depth image, and detection of its supporting plane."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import mask_of, number, numbers
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.imaging.plane import remove_plane
from sdftrack.primitives.result import TABLE

OFF, ON, UNKNOWN = 0, 1, 2  # the core's labels
# Half the thickness of a table in measurements at up to 1 m; it grows with the square of the depth.
TABLE_M = 0.008
SURE_TABLE_M = 0.003  # a measurement above this may be the object's foot
BAND = 0.5  # of TABLE_M, above and below: where a measurement's neighbours say whether it is the table's
BAND_PX = 5  # width of the window of these neighbours
FOOT_M = 0.03  # an object seen as far down as this stands on the table
STEP_M = 0.02  # a step in depth, at up to 1 m, that parts two things
MIN_PIECE = 60  # measurements
CRUMB_PX = 7  # width of the window about a piece in which a smaller one is part of it
OWN_FACE = 0.5  # a plane that holds so much of the masked object is its own face

Plane = tuple[NDArray[np.float64], float]


@dataclass(frozen=True)
class SegmentedFrame:
    """A frame, its camera, the points of its pixels, and the table, if any."""

    frame: Frame
    camera: Camera
    depth: NDArray[np.float32]
    points: NDArray[np.float64]
    plane: Plane | None

    @classmethod
    def of(cls, frame: Frame, camera: Camera, plane: Any, mask: NDArray[np.bool_] | None) -> SegmentedFrame:
        """`plane`: "auto" to search, None: none, or (n, d)."""
        assert frame.depth is not None
        points = camera.back_project(frame.depth).astype(np.float64)
        found = table_under(frame.depth, camera, points, mask) if isinstance(plane, str) else plane
        return cls(frame, camera, frame.depth, points, found)

    @property
    def growth(self) -> NDArray[np.float64]:
        """Noise of each measurement relative to that at 1 m."""
        return np.maximum(1.0, self.depth.astype(np.float64) ** 2)

    def heights(self) -> NDArray[np.float64]:
        """Height of every measurement above the table, m; inf without a table."""
        if self.plane is None:
            return np.full(self.depth.shape, np.inf)
        return self.points @ self.plane[0] + self.plane[1]

    def low(self) -> NDArray[np.bool_]:
        """Measurements that are, or may be, on the table."""
        # Near the threshold the mean of the neighbours decides. With a per-pixel decision, measurements raised by noise
        # would be kept and lowered ones dropped, so that the foot would bulge by millimetres.
        import cv2

        share = self.heights() / (TABLE_M * self.growth)
        if self.plane is None:
            return np.zeros(share.shape, bool)
        valid = (self.depth > 0).astype(np.float32)
        window = (BAND_PX, BAND_PX)
        near = cv2.blur(np.clip(share, -1, 3).astype(np.float32) * valid, window)
        mean = near / np.maximum(cv2.blur(valid, window), 1e-6)
        low: NDArray[np.bool_] = np.where(np.abs(share - 1) < BAND, mean <= 1, share <= 1)
        return low

    def labels(self, mask: NDArray[np.bool_], own_foot: bool) -> NDArray[np.uint8]:
        """Label of each pixel for the object in `mask`. `own_foot`: adjacent low measurements may belong to it."""
        if own_foot:
            labels = self._labels(mask, True)
        else:  # nothing outside the mask: a window is enough
            rows, columns = _window(mask)
            labels = np.full(self.depth.shape, OFF, np.uint8)
            part = replace(self, depth=self.depth[rows, columns], points=self.points[rows, columns])
            labels[rows, columns] = part._labels(mask[rows, columns], False)
        if self.frame._given is not None:
            labels[self.frame._given == 0] = UNKNOWN  # filled: across a round surface it lies behind it
        return labels

    def _labels(self, mask: NDArray[np.bool_], own_foot: bool) -> NDArray[np.uint8]:
        height, growth = self.heights(), self.growth
        valid = self.depth > 0
        low = self.low()
        labels = np.full(self.depth.shape, OFF, np.uint8)
        labels[valid & mask & ~low] = ON
        doubtful = mask & low
        if own_foot:
            doubtful |= low & (height > SURE_TABLE_M * growth)
        labels[doubtful] = UNKNOWN
        return labels

    def view(self, labels: NDArray[np.uint8]) -> Any:
        """The core's view of the pixels labelled as object."""
        view = _core.PrimitiveView.of_image(self.depth, labels, self.camera._core)
        if self.plane is not None:
            on = labels == ON
            heights = self.points[on] @ self.plane[0] + self.plane[1]
            above = heights / np.maximum(1.0, self.depth[on].astype(np.float64) ** 2)
            stands = len(above) > 0 and float(np.quantile(above, 0.01)) < FOOT_M
            view.set_plane(self.plane[0].tolist(), self.plane[1], stands)
        return view


def _window(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The rows and columns about a mask, and the neighbours that decide what is low in it."""
    ends = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    if not len(ends[0]):
        return slice(0, 1), slice(0, 1)
    rows, columns = (slice(max(0, e[0] - BAND_PX), e[-1] + 1 + BAND_PX) for e in ends)
    return rows, columns


def camera_of(frame: Frame, camera: Camera | RGBDCamera | None) -> Camera:
    """The depth camera of a frame; ValueError without one."""
    if camera is None and frame.camera is None:
        raise ValueError(
            "camera: expected the depth camera of the frame, got None, and the frame has none of its own; pass "
            "camera=, or give points"
        )
    pinhole = depth_camera(camera if camera is not None else frame.camera)  # type: ignore[arg-type]
    if frame.depth is None:
        why = frame.error or "it has only colour"
        raise ValueError(f"frame: expected a depth image, got none ({why})")
    if frame.depth.shape != pinhole.shape:
        raise ValueError(
            f"camera: expected the depth image's size {frame.depth.shape[1]} x {frame.depth.shape[0]}, got "
            f"{pinhole.width} x {pinhole.height}; scale it with Camera.scaled"
        )
    return pinhole


def checked_mask(mask: ArrayLike | None, frame: Frame) -> NDArray[np.bool_] | None:
    """`mask`, or the frame's own, as bool in the depth image's geometry."""
    given = frame.mask if mask is None else mask
    if given is None:
        return None
    assert frame.depth is not None
    out = mask_of(given, frame.shape)
    if not (out & (frame.depth > 0)).any():
        raise ValueError(
            f"mask: expected some depth measurements within it, got none ({np.count_nonzero(out)} pixels are set)"
        )
    return out


def checked_plane(plane: Any) -> Any:
    """``"auto"``, None, or (n, d) with n of unit length."""
    if plane is None or (isinstance(plane, str) and plane == "auto"):
        return plane
    if not (isinstance(plane, tuple) and len(plane) == 2):
        raise TypeError(f"plane: expected 'auto', None or (n, d), got {plane!r}")
    normal, offset = numbers(plane[0], "plane"), number(plane[1], "plane")
    length = float(np.linalg.norm(normal)) if normal.shape == (3,) else 0.0
    if not (np.isfinite(length) and length > 0 and np.isfinite(offset)):
        raise ValueError(f"plane: expected a normal of three numbers and an offset in m, got {plane!r}")
    return normal / length, offset / length


def table_under(
    depth: NDArray[np.float32], camera: Camera, points: NDArray[np.float64], mask: NDArray[np.bool_] | None
) -> Plane | None:
    """The dominant plane, unless it is a face of the object itself."""
    try:
        _, (normal, offset) = remove_plane(
            Frame(depth, check_units=False), camera, tolerance=TABLE_M, threads=1
        )
    except ValueError:  # there is none
        return None
    if mask is not None:
        on = mask & (depth > 0)
        near = np.abs(points[on] @ normal + offset) < TABLE_M
        if near.mean() > OWN_FACE:
            return None
    return normal, offset


def pieces(seen: SegmentedFrame, mask: NDArray[np.bool_] | None = None) -> list[NDArray[np.bool_]]:
    """Connected pieces above the table, separated at depth discontinuities; the largest first."""
    import cv2

    depth, growth = seen.depth, seen.growth
    above = (depth > 0) & ~seen.low()
    if mask is not None:
        above &= mask
    step = np.zeros(depth.shape, bool)
    for axis in (0, 1):
        jump = np.abs(np.diff(depth, axis=axis)) > STEP_M * np.maximum(1, np.minimum(*_pairs(growth, axis)))
        both = np.minimum(*_pairs(above.astype(np.uint8), axis)) > 0
        edge = np.zeros(depth.shape, bool)
        edge[(slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))] = jump & both
        step |= edge
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        (above & ~step).astype(np.uint8), connectivity=4
    )
    order = sorted(range(1, count), key=lambda k: -int(stats[k, cv2.CC_STAT_AREA]))
    large = [labels == k for k in order if stats[k, cv2.CC_STAT_AREA] >= MIN_PIECE]
    crumbs = above & ~step & (stats[labels, cv2.CC_STAT_AREA] < MIN_PIECE)
    return [_with_rim(piece, depth, above & step, crumbs, STEP_M * growth) for piece in large]


def _with_rim(
    piece: NDArray[np.bool_],
    depth: NDArray[np.float32],
    rim: NDArray[np.bool_],
    crumbs: NDArray[np.bool_],
    step_m: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Add the pixels at its depth edges that are not farther away, because an edge belongs to the nearer side."""
    # Also adds adjacent `crumbs` at its depth: the tip of a cone is thinner than a pixel and thus not connected.
    import cv2

    own = np.where(piece, depth, np.float32(0))
    out: NDArray[np.bool_] = piece.copy()
    for some, width in ((rim, 3), (crumbs, CRUMB_PX)):
        near = cv2.dilate(own, np.ones((width, width), np.uint8))
        out |= some & (near > 0) & (np.abs(depth - near) < step_m)
    return out


def _pairs(a: NDArray[Any], axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    return (a[:-1], a[1:]) if axis == 0 else (a[:, :-1], a[:, 1:])


# -- Association of measurements with a previously known surface


NEAR_M = 0.03  # measurements so near, at up to 1 m, may be the object's after it has moved a little
STILL_M = 0.008  # and so near where it has not moved: what it touches is not in the mask then
SPREADS = 4.0  # of the median distance: what a band about a surface has to hold
ALONE = 0.6  # share of a piece that is near: the piece is the object and nothing else


def distance_to(seen: SegmentedFrame, kind: str, lengths: list[float], T_cam_obj: NDArray[np.float64]) -> Any:
    """Distance of every measurement to the surface (H, W), m, normalised to the noise at 1 m; inf if missing."""
    T = np.linalg.inv(T_cam_obj)
    points = np.ascontiguousarray(seen.points.reshape(-1, 3) @ T[:3, :3].T + T[:3, 3])
    phi, _, _ = _core.primitive_distances(TABLE[kind].member, lengths, points)
    away = np.abs(phi).reshape(seen.depth.shape) / seen.growth
    return np.where(seen.depth > 0, away, np.inf)


def mask_near(
    seen: SegmentedFrame, kind: str, lengths: list[float], T_cam_obj: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]] | None:
    """Mask of an object that was at a pose, and the whole connected piece that contains it."""
    # Among the pieces on the table, the one with the most measurements near the old surface, or the nearest one if none
    # has any. If a piece contains other objects too (they touch), only a band around the surface is used, as wide as
    # its measurements require. None: there is nothing within the object's size of its old location.
    away = distance_to(seen, kind, lengths, T_cam_obj)
    found = pieces(seen)
    if not found:
        return None
    held = [int(np.count_nonzero(away[piece] < NEAR_M)) for piece in found]
    if not max(held):
        nearest = [float(away[piece].min()) for piece in found]
        longest = float(np.array(lengths)[TABLE[kind].is_length].max())
        k = int(np.argmin(nearest))
        return None if nearest[k] > max(2 * longest, NEAR_M) else (found[k], found[k])
    k = int(np.argmax(held))
    piece = found[k]
    if held[k] >= ALONE * np.count_nonzero(piece):
        return piece, piece
    band = SPREADS * float(np.median(away[piece & (away < NEAR_M)]))
    return piece & (away < np.clip(band, STILL_M, NEAR_M)), piece
