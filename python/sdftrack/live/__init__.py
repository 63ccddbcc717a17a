# SPDX-License-Identifier: MIT
"""Frames from a camera while it runs: one interface for every device."""

from sdftrack.live.camera import LiveCamera, open_camera
from sdftrack.live.sources import CameraLost, FrameSource, register_camera

__all__ = ["CameraLost", "FrameSource", "LiveCamera", "open_camera", "register_camera"]
