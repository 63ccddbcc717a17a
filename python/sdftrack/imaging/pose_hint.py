# SPDX-License-Identifier: MIT
"""Validated hints for an object's location at a start, as passed to the core; the region around a click."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.validation import detached, numbers
from sdftrack.camera import Camera, depth_camera

# A (4, 4) float64 pose, an (H, W) uint8 mask, a box (x, y, w, h) of whole pixels, a click (x, y), or None: anywhere.
Place = NDArray[np.float64] | NDArray[np.uint8] | tuple[int, int, int, int] | tuple[float, float] | None


def is_mask(place: Place) -> bool:
    return isinstance(place, np.ndarray) and place.dtype == np.uint8


def mask_place(mask: Any, name: str, camera: Camera) -> NDArray[np.uint8]:
    given = np.asarray(detached(mask))
    if given.dtype != bool and given.dtype != np.uint8:
        raise TypeError(f"{name}: expected (H, W) bool or uint8, got {given.dtype} {given.shape}")
    if given.shape != (camera.height, camera.width):
        raise ValueError(
            f"{name}: expected the depth image's shape ({camera.height}, {camera.width}), got {given.shape}"
        )
    if not given.any():
        raise ValueError(f"{name}: expected at least one pixel of the object, got an empty mask (all 0)")
    return np.ascontiguousarray(given).view(np.uint8)


def box_place(box: Any, name: str, camera: Camera) -> tuple[int, int, int, int]:
    values = numbers(box, name)
    if values.shape != (4,) or not np.isfinite(values).all():
        raise ValueError(f"{name}: expected (x, y, w, h), got {box!r}")
    x, y, w, h = values.tolist()
    if w <= 0 or h <= 0:
        raise ValueError(f"{name}: expected a width and a height above 0, got {w:g} x {h:g}")
    x0, y0 = max(0, math.floor(x)), max(0, math.floor(y))
    x1, y1 = min(camera.width, math.ceil(x + w)), min(camera.height, math.ceil(y + h))
    if x0 >= x1 or y0 >= y1:
        raise ValueError(
            f"{name}: expected a box that overlaps the image ({camera.width} x {camera.height} px), got {box!r}"
        )
    return x0, y0, x1 - x0, y1 - y0


def moved_into(
    box: tuple[float, float, float, float], T: NDArray[np.float64], points: NDArray[Any], camera: Camera
) -> NDArray[np.float64]:
    """``T_cam_obj`` with the rotation of `T` and the position at which the object fills a box (x, y, w, h), px.
    `points`: (N, 3), the object's vertices, m. The middle of their extent is projected to the middle of the box."""
    x, y, w, h = box
    row = min(max(round(y + h / 2), 0), camera.height - 1)
    column = min(max(round(x + w / 2), 0), camera.width - 1)
    ray = np.append(camera.rays[row, column].astype(np.float64), 1.0)
    turned = np.asarray(points, np.float64) @ T[:3, :3].T
    turned -= (middle := 0.5 * (turned.min(axis=0) + turned.max(axis=0)))
    nearest = -float(turned[:, 2].min())  # closer than this, a part would be behind the camera
    z = max(float(T[2, 3] + middle[2]), 1.1 * nearest)
    for _ in range(5):  # the extent is inversely proportional to z only where the object is far away
        extent = np.ptp(camera.project(turned + z * ray), axis=0)
        z = max(z * float(np.hypot(*extent)) / math.hypot(w, h), 1.1 * nearest)
    moved = np.array(T)
    moved[:3, 3] = z * ray - middle
    return moved


def click_list(clicks: Any, count: int) -> list[Place]:
    """One pixel (x, y) per shape; for a single shape the two numbers suffice."""
    given = np.asarray(clicks, dtype=object if isinstance(clicks, str) else float)
    if count == 1 and given.shape == (2,):
        given = given[None]
    if given.shape != (count, 2):
        raise ValueError(f"clicks: expected one (x, y) per shape ({count}), got {clicks!r}")
    return [(float(x), float(y)) for x, y in given]


_KINDS: dict[str, tuple[Callable[[Any, str, Camera], Place], int, str]] = {
    "poses": (lambda pose, name, camera: rigid_pose(pose, name), 2, "(4, 4) T_cam_obj"),
    "masks": (mask_place, 2, "(H, W) mask"),
    "boxes": (box_place, 1, "box (x, y, w, h)"),
}


def place_list(kind: str, given: Any, count: int, camera: Camera) -> list[Place]:
    """One hint per shape; for a single shape the pose, mask or box itself suffices, without a list."""
    convert, ndim, what = _KINDS[kind]
    if count == 1 and _is_single(given, ndim):
        given = [given]
    if isinstance(given, (str, bytes)) or not hasattr(given, "__iter__"):
        raise TypeError(f"{kind}: expected one {what} per shape ({count}), got {given!r}")
    places: list[Place] = [convert(p, f"{kind}[{k}]", camera) for k, p in enumerate(given)]
    if len(places) != count:
        raise ValueError(f"{kind}: expected one per shape ({count}), got {len(places)}")
    return places


def _is_single(given: Any, ndim: int) -> bool:
    if hasattr(given, "ndim"):
        return bool(given.ndim == ndim)
    for _ in range(ndim):
        if not isinstance(given, (list, tuple)) or not given:
            return False
        given = given[0]
    return isinstance(given, (int, float, np.number))


def one_place(pose: Any, mask: Any, box: Any, camera: Camera) -> Place:
    """At most one of the three; none: anywhere in the image."""
    given = [name for name, value in (("pose", pose), ("mask", mask), ("box", box)) if value is not None]
    if len(given) > 1:
        raise ValueError(f"expected one of pose, mask and box, got {' and '.join(given)}")
    if pose is not None:
        return rigid_pose(pose, "pose")
    if mask is not None:
        return mask_place(mask, "mask", camera)
    return None if box is None else box_place(box, "box", camera)


def connected_region(frame: Any, camera: Any, px: tuple[float, float], reach_m: float) -> NDArray[np.bool_]:
    """Pixels connected to `px` without a depth discontinuity, within `reach_m`, and not on the dominant plane. `px`
    (x, y) are depth pixels, `reach_m` is the object's diameter. ValueError without depth at or near `px`, or with
    almost no connected pixels there."""
    lens = depth_camera(camera)
    if frame.depth is None:
        raise ValueError(f"expected a depth image, got none{': ' + frame.error if frame.error else ''}")
    rays = lens.rays if lens.distortion else None
    return _core.connected_region(frame.depth, lens._core, rays, px, reach_m)
