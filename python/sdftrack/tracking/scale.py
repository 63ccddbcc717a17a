# SPDX-License-Identifier: MIT
"""Check that a shape has the size of the observed object: reports a wrong unit before a search fails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.imaging.click_regions import nearest_reading

FACTOR = 8.0  # between what is seen and the shape: a view may show a part, and a mask more than the object
COARSE = 50  # voxels along the shortest side that are enough to tell a size
INCH_AND_CM = 200.0  # a larger factor is that of millimetres
MIN_PX, MAX_IMAGES = 3.0, 20.0  # how large a shape that is clicked on may appear
ENDS = (0.05, 0.95)  # of a mask's measurements: those behind the object's edge do not count


def size_of(sdf: Any) -> float:
    """Diagonal of the bounding box of the surface, m; from a subset of the voxels."""
    every = max(1, min(sdf.values.shape) // COARSE)
    inside = sdf.values[::every, ::every, ::every] < 0.5 * every * sdf.voxel_size
    sides = [np.flatnonzero(inside.any(axis=axes)) for axes in ((1, 2), (0, 2), (0, 1))]
    return float(every * sdf.voxel_size * math.hypot(*(float(np.ptp(s)) if len(s) else 0.0 for s in sides)))


def extent_of(camera: Any, depth: NDArray[np.float32], mask: NDArray[np.bool_]) -> float:
    """Extent of the measurements in a mask along their longest direction, m, without 5 % at each end."""
    chosen = mask & (depth > 0)
    if np.count_nonzero(chosen) < 3:
        return 0.0
    p = depth_camera(camera).back_project(depth)[chosen]
    along = np.linalg.eigh(np.cov(p.T))[1][:, 2]
    low, high = np.quantile(p @ along, ENDS)
    return float((high - low) / (ENDS[1] - ENDS[0]))


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
