# SPDX-License-Identifier: MIT
"""Learns the colours of object and background from keyframes, for a tracker without colour models."""

from __future__ import annotations

from sdftrack.camera import Camera
from sdftrack.reconstruction.keyframe import Keyframe
from sdftrack.tracking import Tracker
from sdftrack.tracking.interface import TrackerInterface

__all__ = ["learn_colors"]

LAST = 20  # what came before, a tracker that has followed all of them has nearly forgotten


def learn_colors(tracker: Tracker, keyframes: list[Keyframe], camera: Camera, index: int) -> None:
    """Let a tracker with their shape learn from the last of `keyframes`; its pose must be set again afterwards."""
    colored = [s for s in keyframes if s.rgb is not None][-LAST:]
    TrackerInterface(tracker).relearn_colors(((s.frame(camera), s.T_cam_obj) for s in colored), index)
