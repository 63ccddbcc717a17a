# SPDX-License-Identifier: MIT
"""The colours of object and background, learnt from kept frames by a tracker that has not seen any."""

from __future__ import annotations

from sdftrack.camera import Camera
from sdftrack.reconstruction.shots import Shot
from sdftrack.tracking import Tracker

__all__ = ["learn_colors"]

LAST = 20  # what came before, a tracker that has followed all of them has nearly forgotten


def learn_colors(tracker: Tracker, shots: list[Shot], camera: Camera) -> None:
    """Show the last of `shots` to a tracker that has their shape; where it stands afterwards is to be set anew."""
    for n, shot in enumerate([s for s in shots if s.rgb is not None][-LAST:]):
        if n == 0:
            tracker.start(shot.frame(camera), poses=shot.T_cam_obj)
        else:
            tracker.set_pose(0, shot.T_cam_obj)
            tracker.track(shot.frame(camera))
    tracker._last = None  # no motion leads from there to the next frame
