# SPDX-License-Identifier: MIT
"""What `sdftrack live` runs on each frame: a tracker of known shapes, or a reconstructor."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import sdftrack as st
from sdftrack.camera import depth_camera
from sdftrack.cli.init import Init, StartError, begin, read_poses
from sdftrack.cli.objects import Target
from sdftrack.imaging.pose_hint import moved_into, one_place
from sdftrack.tracking.interface import TrackerInterface

NO_COLOR = "this frame has no colour image"
BOX_SHARE = 0.5  # of the image's shorter side: the box about a click in which a reconstruction begins


def has(frame: Any, image: str) -> bool:
    """Whether the frame has the image that a follower needs."""
    return (frame.depth if image == "depth" else frame.color) is not None


def unknown_sequence(camera: Any) -> Any:
    """What a data set knows about a sequence, for a camera: nothing but its lens."""
    return SimpleNamespace(camera=camera, models={}, objects=[], ground_truth={}, masks=lambda i: {})


class Follower:
    """Follows objects from frame to frame; started by options or by the user.

    `needs` is the image without which a frame is of no use, `start_by` what the user does with an object to start it,
    `mask` the object's pixels in the last frame if that is what is followed, `missing` the names of the objects that
    have to be shown by the user before it starts.
    """

    names: list[str]
    needs = "depth"
    start_by = "click on"
    _started = False

    @property
    def mask(self) -> Any:
        return None

    @property
    def missing(self) -> list[str]:
        return [] if self._started else self.names

    def frames_of(self, camera: Any) -> Any:
        """The camera whose frames are followed."""
        return camera

    def step(self, frame: Any) -> Any:
        """The result of the frame; None until it is known where the objects are."""
        raise NotImplementedError

    def click(self, frame: Any, k: int, px: tuple[float, float]) -> Any:
        """Start object k at a pixel of the image; ValueError if it is not there."""
        raise NotImplementedError

    def box(self, frame: Any, k: int, box: tuple[float, float, float, float]) -> Any:
        """Start object k in a box (x, y, w, h) of the image."""
        raise NotImplementedError


class TrackerFollower(Follower):
    """A tracker that is started by --init, or without `inits` by a click or box for each object."""

    def __init__(self, tracker: Any, targets: list[Target], inits: list[Init] | None) -> None:
        self.names = [t.name for t in targets]
        self._tracker, self._targets, self._inits = tracker, targets, inits
        self.needs = "colour" if tracker.mode == "rgb" else "depth"
        self._waiting: dict[int, Any] = {}  # places of objects, until all are known

    def step(self, frame: Any) -> Any:
        if self._started:
            return self._tracker.track(self._usable(frame))
        if self._inits is None or not has(frame, self.needs):
            return None
        seq = unknown_sequence(self._tracker.camera)
        try:
            result = begin(self._tracker, self._inits, self._targets, frame, Path("camera"), 0, seq)[0]
        except StartError as error:
            raise ValueError(str(error)) from None
        self._started = True
        return result

    def click(self, frame: Any, k: int, px: tuple[float, float]) -> Any:
        if self._tracker.mode == "rgb":
            return self._start_again(frame, k)
        inner = TrackerInterface(self._tracker)
        found = inner.place_at_click(k, frame, px, f"click on {self.names[k]}")
        if self._started:
            given: dict[str, Any] = {"mask": found.region} if found.box is None else {"box": found.box}
            return self._tracker.recover(frame, k, **given)
        return self._begin_with(frame, k, found.place)

    def box(self, frame: Any, k: int, box: tuple[float, float, float, float]) -> Any:
        if self._tracker.mode == "rgb":
            return self._start_again(frame, k, box)
        if self._started:
            return self._tracker.recover(frame, k, box=box)
        camera = self._tracker.camera if frame.camera is None else frame.camera
        return self._begin_with(frame, k, one_place(None, None, box, depth_camera(camera)))

    def _usable(self, frame: Any) -> Any:
        """The frame; a bad one instead of an error if a camera with depth has lost the colour that is needed."""
        if self.needs == "depth" or has(frame, self.needs):
            return frame
        return st.Frame.unreadable(frame.error or NO_COLOR, frame.timestamp, frame.index)

    def _start_again(self, frame: Any, k: int, box: tuple[float, float, float, float] | None = None) -> Any:
        """Without depth there is no search: the object is as in --init, moved into the box if there is one."""
        if not self._started or self._inits is None:
            return self.step(frame)
        T = read_poses(Path(self._inits[0].text), len(self.names))[k]
        if box is not None:
            camera = self._tracker.camera if frame.camera is None else frame.camera
            T = moved_into(box, T, self._targets[k].mesh.vertices, depth_camera(camera))
        self._tracker.set_pose(k, T)
        return self._tracker.track(frame)

    def _begin_with(self, frame: Any, k: int, place: Any) -> Any:
        self._waiting[k] = place
        if len(self._waiting) < len(self.names):
            return None
        places = [self._waiting[j] for j in range(len(self.names))]
        self._waiting.clear()
        self._started = True
        return TrackerInterface(self._tracker).start_at(frame, places)

    @property
    def missing(self) -> list[str]:
        """Names of the objects that the user has not shown yet."""
        return [] if self._started else [n for k, n in enumerate(self.names) if k not in self._waiting]


class ReconstructorFollower(Follower):
    """A reconstructor that is started by `init`, arguments of its `start`, or by a click or box; its mesh grows."""

    def __init__(self, star: Any, init: dict[str, Any] | None) -> None:
        self.names = ["object"]
        self.star, self._init = star, init

    @property
    def shapes(self) -> list[Any]:
        return [self.star.shape] if self._started else []

    def step(self, frame: Any) -> Any:
        if self._started:
            return self.star.track(frame)
        if self._init is None or frame.depth is None:
            return None
        return self._start(frame, **self._init)

    def click(self, frame: Any, k: int, px: tuple[float, float]) -> Any:
        height, width = frame.shape
        side = BOX_SHARE * min(height, width)
        return self._start(frame, box=(px[0] - side / 2, px[1] - side / 2, side, side))

    def box(self, frame: Any, k: int, box: tuple[float, float, float, float]) -> Any:
        return self._start(frame, box=box)

    def _start(self, frame: Any, **where: Any) -> Any:
        result = self.star.start(frame, **where)
        self._started = True
        return result
