# SPDX-License-Identifier: MIT
"""Frames from a camera while it runs: one interface for every device."""

from sdftrack.live.camera import CameraLost, FrameSource, LiveCamera, open_camera, register_camera

__all__ = ["CameraLost", "FrameSource", "LiveCamera", "open_camera", "register_camera"]
