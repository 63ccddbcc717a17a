# SPDX-License-Identifier: MIT
"""What hangs together in a depth image, and the planes around it (in the core)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera, depth_camera

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def _rays(camera: Camera) -> NDArray[np.float32] | None:
    return camera.rays if camera.distortion else None


class NearPlane(NamedTuple):
    """``normal . p + offset = 0``, the normal towards the camera; its pixels in the window, and their extent, m."""

    normal: Array
    offset: float
    pixels: Mask
    extent_m: float


def planes_near(
    depth: NDArray[np.float32],
    camera: Camera,
    around: Mask,
    size_m: float,
    window: tuple[slice, slice] | None = None,
) -> list[NearPlane]:
    """Planes among the pixels `around` (H, W) with a connected extent larger than an object of `size_m`.

    `window`: rows and columns of the image that are looked at, with one step.
    """
    rows, columns = window or (slice(0, camera.height, 1), slice(0, camera.width, 1))
    box = [columns.start, rows.start, columns.stop, rows.stop]
    found = _core.planes_near(
        depth, camera._core, _rays(camera), around.view(np.uint8), box, rows.step or 1, size_m
    )
    return [NearPlane(np.array(normal), offset, pixels, extent) for normal, offset, pixels, extent in found]


def connected_region(frame: Any, camera: Any, px: tuple[float, float], reach_m: float) -> Mask:
    """Pixels connected to `px` without a depth discontinuity, within `reach_m`, and not on the dominant plane.

    `px` (x, y) are depth pixels, `reach_m` is the object's diameter. ValueError without depth at or near `px`, or with
    almost no connected pixels there.
    """
    lens = depth_camera(camera)
    if frame.depth is None:
        raise ValueError(f"expected a depth image, got none{': ' + frame.error if frame.error else ''}")
    return _core.connected_region(frame.depth, lens._core, _rays(lens), px, reach_m)
