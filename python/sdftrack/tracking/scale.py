# SPDX-License-Identifier: MIT
"""Check that a shape has the size of the observed object: reports a wrong unit before a search fails."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.imaging.click_regions import connected_region, nearest_reading
from sdftrack.imaging.pose_hint import is_mask
from sdftrack.results import Status, TrackResult

FACTOR = 8.0  # between what is seen and the shape: a view may show a part, and a mask more than the object
COARSE = 50  # voxels along the shortest side that are enough to tell a size
INCH_AND_CM = 200.0  # a larger factor is that of millimetres
MIN_PX, MAX_IMAGES = 3.0, 20.0  # how large a shape that is clicked on may appear
COARSE_DIAMETER, DIRECTIONS = 24, 200
LARGER, SMALLER = 1.15, 0.4  # times the diameter: extents that no view of the whole object has
UNLIKELY = 0.1  # confidence of a pose that explains nothing
ALONE = 0.95  # of a region that lies within its box
VIEW = (0.55, 1.1)  # extents of views over the diameter
TIMES, OF = " times", " of"
PARTS = (5.0, 4.0)  # of a millimetre: units of depth in TUM folders and of some sensors
ENDS = (0.05, 0.95)  # of a mask's measurements: those behind the object's edge do not count


def size_of(sdf: Any) -> float:
    """Diagonal of the bounding box of the surface, m; from a subset of the voxels."""
    return _measured_once(sdf, "size", _size_of)


def diameter_of(sdf: Any) -> float:
    """Largest extent of the surface in any direction, m; from a subset of the voxels."""
    return _measured_once(sdf, "diameter", _diameter_of)


def _measured_once(sdf: Any, name: str, measure: Callable[[Any], float]) -> float:
    if name not in sdf._lengths:
        sdf._lengths[name] = measure(sdf)
    length: float = sdf._lengths[name]
    return length


def _size_of(sdf: Any) -> float:
    every = max(1, min(sdf.values.shape) // COARSE)
    inside = sdf.values[::every, ::every, ::every] < 0.5 * every * sdf.voxel_size
    sides = [np.flatnonzero(inside.any(axis=axes)) for axes in ((1, 2), (0, 2), (0, 1))]
    return float(every * sdf.voxel_size * math.hypot(*(float(np.ptp(s)) if len(s) else 0.0 for s in sides)))


def extent_of(camera: Any, depth: NDArray[np.float32], mask: NDArray[np.bool_]) -> float:
    """Extent of the measurements in a mask along their longest direction, m, without 5 % at each end."""
    chosen = mask & (depth > 0)
    if np.count_nonzero(chosen) < 3:
        return 0.0
    z = depth[chosen, np.newaxis].astype(np.float64)
    p = np.hstack([depth_camera(camera).rays[chosen] * z, z])
    low, high = np.quantile(p @ np.linalg.eigh(np.cov(p.T))[1][:, 2], ENDS)
    return float((high - low) / (ENDS[1] - ENDS[0]))


def _diameter_of(sdf: Any) -> float:
    every = max(1, min(sdf.values.shape) // COARSE_DIAMETER)
    inside = sdf.values[::every, ::every, ::every] < 0.5 * every * sdf.voxel_size
    points = np.argwhere(inside)[:, ::-1].astype(np.float32)
    if not len(points):
        return 0.0
    directions = np.random.default_rng(0).normal(size=(3, DIRECTIONS)).astype(np.float32)
    extents = np.ptp(points @ (directions / np.linalg.norm(directions, axis=0)), axis=0)
    return float(every * sdf.voxel_size * extents.max())


def scale_doubt(frame: Any, camera: Any, region: NDArray[np.bool_], sdf: Any) -> str:
    """What the extent of the measurements in a region says about a start there that has failed; "": nothing.

    No view of an object extends over more than its diameter. One may extend over much less: along the longest axis, or
    where it is partly hidden.
    """
    if frame.depth is None or not region.any():
        return ""
    seen, size = extent_of(camera, frame.depth, region), diameter_of(sdf)
    if seen == 0 or size == 0 or SMALLER < seen / size < LARGER:
        return ""
    cut = region[0].any() or region[-1].any() or region[:, 0].any() or region[:, -1].any()
    if seen < size and cut:
        return ""
    ratio = seen / size
    times = f"{ratio:.2g}{TIMES if ratio > 1 else OF}"
    text = (
        f"the depth measurements there extend over {_length(seen)}, {times} the {_length(size)} of the mesh: "
    )
    large = max(ratio, 1 / ratio)
    low, high = VIEW if ratio > 1 else (1 / VIEW[1], 1 / VIEW[0])
    fine = " or ".join(f"1/{1000 * part:.0f} m" for part in PARTS if large / high < part < large / low)
    if fine:
        unit, read = (fine, "millimetres") if ratio > 1 else ("millimetres", fine)
        return text + f"is the depth in {unit} and read as {read}?"
    return text + "check the units of depth and mesh, and that the mesh has the object's size"


def with_scale_doubts(
    result: TrackResult,
    frame: Any,
    camera: Any,
    places: list[Any],
    shapes: list[Any],
    has_size: Callable[[int], bool],
) -> TrackResult:
    """The result of a start at masks or boxes; reasons name a wrong scale, but not where an object is ok."""
    reasons = list(result.reason)
    for k, place in enumerate(places):
        if result.status[k] not in (Status.LOST, Status.WEAK) or not has_size(k):
            continue
        region = _region_of(frame, camera, place)
        doubt = "" if region is None else scale_doubt(frame, camera, region, shapes[k])
        # A pose that is found, weakly, explains why little is seen, but not that more is.
        believed = result.status[k] is Status.WEAK and result.confidence[k] > UNLIKELY
        if doubt and (not believed or TIMES in doubt):
            reasons[k] = f"{reasons[k]}; {doubt}"
    return result if reasons == list(result.reason) else replace(result, reason=reasons)


def _region_of(frame: Any, camera: Any, place: Any) -> NDArray[np.bool_] | None:
    """The pixels of a mask, or what stands alone in the middle of a box; None: a pose, or nothing does."""
    if frame.depth is None or place is None:
        return None
    if isinstance(place, np.ndarray):
        return place != 0 if is_mask(place) else None
    x, y, w, h = place
    readings = frame.depth[y : y + h, x : x + w]
    if not (readings > 0).any():
        return None
    reach_m = math.hypot(w, h) / depth_camera(camera).fx * float(np.median(readings[readings > 0]))
    try:
        whole = connected_region(frame, camera, (x + 0.5 * w, y + 0.5 * h), reach_m)
    except ValueError:
        return None
    inside = np.zeros(whole.shape, bool)
    inside[y : y + h, x : x + w] = whole[y : y + h, x : x + w]
    return inside if np.count_nonzero(inside) > ALONE * np.count_nonzero(whole) else None


def check_scale(frame: Any, camera: Any, mask: NDArray[np.bool_], sdf: Any, name: str) -> None:
    """ValueError if the extent of the measurements in a mask differs from the size of the shape."""
    if frame.depth is None:
        return
    seen, size = extent_of(camera, frame.depth, mask), size_of(sdf)
    if seen == 0 or size / FACTOR < seen < FACTOR * size:
        return
    raise ValueError(
        f"{name}: expected the object, {_length(size)} across by its mesh, got depth measurements that extend over "
        f"{_length(seen)}; " + _advice(size / seen)
    )


def check_size(frame: Any, camera: Any, px: tuple[float, float], sdf: Any) -> None:
    """ValueError if the shape at the depth of `px` would be a speck, or many times larger than the image."""
    v, u = nearest_reading(frame, px)
    z, size, pinhole = float(frame.depth[v, u]), size_of(sdf), depth_camera(camera)
    pixels = pinhole.fx * size / z
    if MIN_PX < pixels < MAX_IMAGES * max(pinhole.shape):
        return
    raise ValueError(
        f"expected an object of visible size, got a shape of {_length(size)} at a distance of {_length(z)}, "
        f"{pixels:.3g} pixels large; " + _advice(1e3 if pixels > MIN_PX else 1e-3)
    )


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 or metres < 1e-4 else f"{1e3 * metres:.3g} mm"


def _advice(ratio: float) -> str:
    """Likely cause if a shape is `ratio` times as large as what is observed."""
    if ratio < 1:
        return "is the depth in millimetres (metres are expected), or was the mesh scaled twice?"
    unit = "mm" if ratio > INCH_AND_CM else "cm or in"
    return f"is the mesh in {unit} and read as metres, or the depth in a larger unit than metres?"
