# SPDX-License-Identifier: MIT
"""Cameras: pixel centres at integers, x right, y down, z forward; depth is z, not ray length."""

from sdftrack.camera.pinhole import Camera
from sdftrack.camera.rgbd import RGBDCamera, depth_camera

__all__ = ["Camera", "RGBDCamera", "depth_camera"]
