# SPDX-License-Identifier: MIT
"""Parts of a start in the core, by frames and cameras."""

from typing import NamedTuple

import numpy as np

from sdftrack import _core
from sdftrack.camera import depth_camera
from sdftrack.camera.rgbd import color_map


def lens(camera):
    """The depth camera in the core's form, and its rays."""
    depth = depth_camera(camera)
    return depth._core, depth.rays if depth.distortion else None


def click_regions(frame, camera, px, size_m):
    color = () if frame.color is None else (frame.color, color_map(camera, frame.color))
    return _core.click_regions(frame.depth, *lens(camera), px, size_m, *color)


def standing_regions(frame, camera, size_m):
    return _core.standing_regions(frame.depth, *lens(camera), size_m)


def nearest_reading(frame, camera, px):
    return _core.nearest_reading(frame.depth, lens(camera)[0], px)


class NearPlane(NamedTuple):
    """``normal . p + offset = 0``, the normal towards the camera; its pixels in the window, and their extent, m."""

    normal: np.ndarray
    offset: float
    pixels: np.ndarray
    extent_m: float


def planes_near(depth, camera, around, size_m, window=None):
    """Planes among the pixels `around` (H, W), in a window of rows and columns with one step."""
    rows, columns = window or (slice(0, camera.height, 1), slice(0, camera.width, 1))
    box = [columns.start, rows.start, columns.stop, rows.stop]
    found = _core.planes_near(depth, *lens(camera), around.view(np.uint8), box, rows.step or 1, size_m)
    return [NearPlane(np.array(normal), offset, pixels, extent) for normal, offset, pixels, extent in found]
