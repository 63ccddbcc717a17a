# SPDX-License-Identifier: MIT
"""Tracking of an object through the frames of a calibration while the camera is estimated."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import of_kind
from sdftrack.calibration.lens import camera_of, extra_of
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.results import Status, TrackResult
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker

MIN_READINGS = 200  # of the object in a frame that is used
FIRST_LOOK, GROWTH = (
    4,
    1.5,
)  # frames when the lens is found first, and by how many times more it is found again
LENS_KNOWN = 20  # frames from which a tracker may judge by the shape
# A lens that is 10 % off bends a shape of some 10 cm by millimetres and ends it in the wrong place: as if by noise,
# and nothing to call the object lost for.
FORGIVING: dict[str, Any] = {"noise_m": 0.006, "lost_inliers": 0.05, "lost_evidence": 1e-6}
LOST_FOR_LONG = 3  # frames after which the object is looked for as if it had never been seen
FOLLOWED = (Status.OK, Status.WEAK)


class Follower:
    """Passes the measurements near the object in each frame to a `_core.Calibration`."""

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
        self._forgives = True
        self._lost_frames = 0

    def follow(
        self, frames: Iterable[Frame], places: dict[str, Any], tell: Callable[[int], None] | None
    ) -> None:
        """Track through all frames; re-estimate the lens whenever their number has grown by half."""
        next_look = FIRST_LOOK
        for i, frame in enumerate(frames):
            of_kind(frame, Frame, f"frames[{i}]", "make one with st.Frame(depth)")
            reason = self._take(frame, places)
            if frame.depth is not None:
                places = {}  # what was said of the first frame does not hold for another
            if reason:
                self.left_out[i] = reason
            else:
                self.used.append(i)
                if len(self.used) == next_look:
                    self._look(next_look)
                    next_look = int(GROWTH * next_look)
            if tell is not None:
                tell(i + 1)

    def _take(self, frame: Frame, places: dict[str, Any]) -> str:
        """Pass one frame to the core; returns the reason if it cannot be used."""
        if frame.depth is None:
            return frame.error or "no depth image"
        seen = self._as_seen(frame.depth, frame.mask)
        result = self._tracked(seen, places)
        if result.status[0] not in FOLLOWED:
            return f"{result.status[0]}: {result.reason[0]}"
        mask = None if frame.mask is None else np.ascontiguousarray(frame.mask).view(np.uint8)
        count = self.core.add(seen.depth, mask, result.poses[0])
        if count < MIN_READINGS:
            self.core.drop([len(self.used)])
            return f"only {count} depth measurements of the object (expected at least {MIN_READINGS})"
        return ""

    def _tracked(self, seen: Frame, places: dict[str, Any]) -> TrackResult:
        if self._tracker is not None:
            lost_for_long = self._lost_frames >= LOST_FOR_LONG
            result = self._tracker.start(seen) if lost_for_long else self._tracker.track(seen)
            self._lost_frames = 0 if result.status[0] in FOLLOWED else self._lost_frames + 1
            return result
        # The camera is wrong at first, so nothing fits finely where it is expected.
        options = {"fine_first": False, **(FORGIVING if self._forgives else {})}
        self._tracker = Tracker(self.sdf, self.first_camera, mode="depth", threads=self.threads, **options)
        result = self._tracker.start(seen, **places)
        if result.status[0] not in FOLLOWED and not self.used:
            self._tracker = None  # the next frame is a start again
        return result

    def _look(self, frames: int) -> None:
        """Estimate the lens and the poses, and continue tracking from there."""
        self.improve(frames)
        if self._forgives and frames >= LENS_KNOWN:
            self._forgives, self._tracker = False, None
            blank = Frame(np.zeros(self.first_camera.shape, np.float32), check_units=False)
            self._tracked(blank, {"poses": self.core.poses[-1]})
        assert self._tracker is not None
        self._tracker.set_pose(0, self.core.poses[-1])

    def _as_seen(self, depth: NDArray[np.float32], mask: NDArray[np.bool_] | None) -> Frame:
        """The frame corrected by the current lens estimate."""
        values = self.core.lens.values
        extra = extra_of(values)
        if extra["depth_scale"] != 1 or extra["depth_offset"] != 0:
            scaled = extra["depth_scale"] * depth + np.float32(extra["depth_offset"])
            depth = np.where(depth > 0, scaled, 0).astype(np.float32)
        camera = camera_of(values, self.first_camera)
        if depth.shape != camera.shape:
            raise ValueError(
                f"frames: expected depth of the camera's size {camera.shape}, got {depth.shape} in one of them"
            )
        return Frame(depth, mask=mask, camera=camera, check_units=False)
