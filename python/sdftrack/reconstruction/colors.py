# SPDX-License-Identifier: MIT
"""The colours of object and background, learnt from kept frames by a tracker that has not seen any."""

from __future__ import annotations

from sdftrack.camera import Camera
from sdftrack.reconstruction.keyframe import Keyframe
from sdftrack.tracking import Tracker
from sdftrack.tracking.interface import TrackerInterface

__all__ = ["learn_colors"]

LAST = 20  # what came before, a tracker that has followed all of them has nearly forgotten


def learn_colors(tracker: Tracker, keyframes: list[Keyframe], camera: Camera, index: int) -> None:
    """Show the last of `keyframes` to a tracker that has their shape; where it stands afterwards is to be set anew."""
    colored = [s for s in keyframes if s.rgb is not None][-LAST:]
    TrackerInterface(tracker).relearn_colors(((s.frame(camera), s.T_cam_obj) for s in colored), index)
