# SPDX-License-Identifier: MIT
"""Parts of a start in the core, by frames and cameras."""

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
