# SPDX-License-Identifier: MIT
"""An object followed through the frames of a calibration while the camera becomes known."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.lens import camera_of, extra_of
from sdftrack.camera import Camera
from sdftrack.checks import of_kind
from sdftrack.frame import Frame
from sdftrack.results import Status
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker

__all__ = ["Follower"]

LEAST_READINGS = 200  # of the object in a frame that is used
FIRST_LOOK, GROWTH = (
    4,
    1.5,
)  # frames after which the lens is found for the first time; and by how much more then
LENS_KNOWN = 10**9
LENS_UNKNOWN_NOISE_M = (
    0.006  # what a lens that is 10 % off does to a shape of some 10 cm, as if it were noise
)


class Follower:
    """Frames in, readings near the object out, to a `_core.Calibration`."""

    def __init__(
        self, core: Any, sdf: SDF, camera: Camera, improve: Callable[[int], None], threads: int
    ) -> None:
        self.core = core
        self.sdf = sdf
        self.first_camera = camera
        self.improve = improve
        self.threads = threads
        self.used: list[int] = []  # numbers of the frames that the core has
        self.left_out: dict[int, str] = {}
        self._tracker: Tracker | None = None

    def follow(
        self, frames: Iterable[Frame], places: dict[str, Any], tell: Callable[[int], None] | None
    ) -> None:
        """Track through all frames; find the lens anew whenever their number has grown by half."""
        next_look = FIRST_LOOK
        for i, frame in enumerate(frames):
            of_kind(frame, Frame, f"frames[{i}]", "make one with st.Frame(depth)")
            reason = self._take(frame, places)
            if reason:
                self.left_out[i] = reason
            else:
                self.used.append(i)
                if len(self.used) == next_look:
                    self.improve(next_look)
                    assert self._tracker is not None
                    self._tracker.set_pose(0, self.core.poses[-1])  # the poses have moved with the lens
                    next_look = int(GROWTH * next_look)
            if tell is not None:
                tell(i + 1)

    def _take(self, frame: Frame, places: dict[str, Any]) -> str:
        """One frame to the core; why not, else."""
        if frame.depth is None:
            return frame.error or "no depth image"
        values = self.core.lens.values
        seen = self._as_seen(frame, values)
        if self._tracker is None:
            # One that forgives what a lens that is 10 % off does to a shape.
            self._tracker = Tracker(
                self.sdf, self.first_camera, mode="depth", threads=self.threads, noise_m=LENS_UNKNOWN_NOISE_M
            )
            result = self._tracker.start(seen, **places)
        else:
            result = self._tracker.track(seen)
        known = len(self.used) >= LENS_KNOWN
        if result.status[0] not in ((Status.OK,) if known else (Status.OK, Status.WEAK)):
            if not self.used:
                self._tracker = None  # the next frame is a start again
            return f"{result.status[0]}: {result.reason[0]}"
        mask = None if frame.mask is None else np.ascontiguousarray(frame.mask).view(np.uint8)
        count = self.core.add(seen.depth, mask, result.poses[0])
        if count < LEAST_READINGS:
            self.core.drop([len(self.used)])
            return f"only {count} readings of the object (expected at least {LEAST_READINGS})"
        return ""

    def _as_seen(self, frame: Frame, values: list[float]) -> Frame:
        """The frame through the lens as it is known by now."""
        assert frame.depth is not None
        extra = extra_of(values)
        depth: NDArray[np.float32] = frame.depth
        if extra["depth_scale"] != 1 or extra["depth_offset"] != 0:
            scaled = extra["depth_scale"] * depth + np.float32(extra["depth_offset"])
            depth = np.where(depth > 0, scaled, 0).astype(np.float32)
        camera = camera_of(values, self.first_camera)
        if depth.shape != camera.shape:
            raise ValueError(
                f"frames: expected depth of the camera's size {camera.shape}, got {depth.shape} in one of them"
            )
        return Frame(depth, mask=frame.mask, camera=camera, check_units=False)
