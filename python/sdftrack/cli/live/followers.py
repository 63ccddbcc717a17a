# SPDX-License-Identifier: MIT
"""What `sdftrack live` runs on each frame: a tracker of known shapes, a reconstructor, or an outline in colour."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import sdftrack as st
from sdftrack._internal.background import Background
from sdftrack.camera import depth_camera
from sdftrack.cli.contour import ContourFiles, bad_frame, trouble_of
from sdftrack.cli.init import Init, StartError, begin, place_of, read_poses
from sdftrack.cli.objects import Target
from sdftrack.imaging.pose_hint import moved_into, one_place
from sdftrack.io.report_file import result_of
from sdftrack.tracking.interface import TrackerInterface

NO_COLOR = "this frame has no colour image"
BOX_SHARE = 0.5  # of the image's shorter side: the box about a click in which a reconstruction begins


def has(frame: Any, image: str) -> bool:
    return (frame.depth if image == "depth" else frame.color) is not None


def unknown_sequence(camera: Any) -> Any:
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
    mask: Any = None
    _started = False

    @property
    def missing(self) -> list[str]:
        return [] if self._started else self.names

    def frames_of(self, camera: Any) -> Any:
        return camera

    def step(self, frame: Any) -> Any:
        """The result of the frame; None until it is known where the objects are."""
        raise NotImplementedError

    def start(self, frame: Any, k: int, place: tuple[float, ...]) -> Any:
        """Start object k at a pixel (x, y) or in a box (x, y, w, h) of the image; ValueError if it is not there."""
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
            if self.needs != "depth" and not has(
                frame, self.needs
            ):  # a camera with depth has lost the colour
                frame = st.Frame.unreadable(frame.error or NO_COLOR, frame.timestamp, frame.index)
            return self._tracker.track(frame)
        if self._inits is None or not has(frame, self.needs):
            return None
        seq = unknown_sequence(self._tracker.camera)
        try:
            result = begin(self._tracker, self._inits, self._targets, frame, Path("camera"), 0, seq)[0]
        except StartError as error:
            raise ValueError(str(error)) from None
        self._started = True
        return result

    def start(self, frame: Any, k: int, place: tuple[float, ...]) -> Any:
        camera = depth_camera(self._tracker.camera if frame.camera is None else frame.camera)
        if self._tracker.mode == "rgb":
            # Without depth there is no search: the object is as in --init, moved into the box if there is one.
            if not self._started or self._inits is None:
                return self.step(frame)
            T = read_poses(Path(self._inits[0].text), len(self.names))[k]
            if len(place) == 4:
                T = moved_into(place, T, self._targets[k].mesh.vertices, camera)
            self._tracker.set_pose(k, T)
            return self._tracker.track(frame)
        inner = TrackerInterface(self._tracker)
        where: dict[str, Any] = {"box": place}
        if len(place) == 2:
            found = inner.place_at_click(k, frame, place, f"click on {self.names[k]}")
            where = {"mask": found.region} if found.box is None else {"box": found.box}
        if self._started:
            return self._tracker.recover(frame, k, **where)
        self._waiting[k] = found.place if len(place) == 2 else one_place(None, None, place, camera)
        if len(self._waiting) < len(self.names):
            return None
        places = [self._waiting[j] for j in range(len(self.names))]
        self._waiting.clear()
        self._started = True
        return inner.start_at(frame, places)

    @property
    def missing(self) -> list[str]:
        return [] if self._started else [n for k, n in enumerate(self.names) if k not in self._waiting]


class ReconstructorFollower(Follower):
    """A reconstructor that is started by `init`, arguments of its `start`, or by a click or box; its mesh grows."""

    def __init__(self, star: Any, init: dict[str, Any] | None) -> None:
        self.names = ["object"]
        self.star, self._init = star, init

    @property
    def shapes(self) -> list[Any]:
        return [self.star.cropped_shape()] if self._started else []

    def step(self, frame: Any) -> Any:
        if self._started:
            return self.star.track(frame)
        if self._init is None or frame.depth is None:
            return None
        result = self.star.start(frame, **self._init)
        self._started = True
        return result

    def start(self, frame: Any, k: int, place: tuple[float, ...]) -> Any:
        if len(place) == 2:
            side = BOX_SHARE * min(frame.shape)
            place = (place[0] - side / 2, place[1] - side / 2, side, side)
        result = self.star.start(frame, box=place)
        self._started = True
        return result


WAITING = 30  # frames that may wait for the disk
TRIES = 30  # frames of which one has to have colour: the first ones of two sensors may come without
# Of a colour camera without intrinsics, for the page: an outline needs none.
ASSUMED_FOV_RAD = math.radians(60)


class ColorAlone:
    """The colour images of a camera, as frames without depth: pixels on the page and of files are theirs."""

    def __init__(self, camera: Any) -> None:
        self._camera = camera
        rig = camera.camera
        self.name = camera.name
        self.camera = st.RGBDCamera(rig.depth if rig.color is None else rig.color)

    @property
    def dropped(self) -> int:
        return int(self._camera.dropped)

    def resume(self) -> None:
        self._camera.resume()

    def age_s(self, frame: Any) -> float:
        return float(self._camera.age_s(frame))

    def __iter__(self) -> Iterator[Any]:
        colored, without = False, 0
        for frame in self._camera:
            colored = colored or frame.color is not None
            without += frame.color is None and not frame.error
            if not colored and without == TRIES:
                raise ValueError(
                    f"--contour: expected colour images, got {TRIES} frames without any from {self.name}"
                )
            yield self._without_depth(frame)

    def _without_depth(self, frame: Any) -> Any:
        if frame.color is None:
            return st.Frame.unreadable(frame.error or NO_COLOR, frame.timestamp, frame.index)
        height, width = frame.color.shape[:2]
        known = self.camera.depth.shape == (height, width)
        lens = None if known else st.Camera.from_fov(ASSUMED_FOV_RAD, width, height)
        return frame.replace(depth=None, mask=None, camera=lens)


class OutlineFollower(Follower):
    """A contour tracker that is started by --init, a box or mask, or by a box that the user drags.

    Its results have no poses (NaN) but status, reason and confidence, as those of other followers; `outline` is the
    ContourResult of the last frame.
    """

    needs, start_by = "colour", "drag a box around"

    def __init__(self, tracker: Any, init: Init | None) -> None:
        self.names = ["object"]
        self.outline: Any = None
        self._tracker, self._init, self.options = tracker, init, dict(tracker.options)

    @property
    def mask(self) -> Any:  # type: ignore[override]
        usable = self.outline is not None and self.outline.status != "bad_frame"
        return self.outline.mask if usable else None

    def frames_of(self, camera: Any) -> Any:
        return ColorAlone(camera)

    def step(self, frame: Any) -> Any:
        if self.outline is None:
            if self._init is None or frame.color is None:
                return None
            self.outline = self._tracker.start(frame.color, **place_of(self._init, frame.shape, "colour"))
            return self._told(frame)
        trouble = frame.error if frame.color is None else trouble_of(frame.color, self.outline)
        if trouble:
            self.outline = bad_frame(self.outline, trouble)
        else:
            self.outline = self._tracker.track(frame.color)
        return self._told(frame)

    def start(self, frame: Any, k: int, place: tuple[float, ...]) -> Any:
        if len(place) == 2:
            raise ValueError("drag a box around the object: a click does not tell its size")
        self.outline = self._tracker.start(frame.color, box=place)
        return self._told(frame)

    def _told(self, frame: Any) -> Any:
        self._started, now = True, self.outline
        row = {"pose": None, "status": now.status, "reason": now.reason, "confidence": now.confidence}
        result = result_of({"objects": [row], "timestamp": frame.timestamp})
        return dataclasses.replace(result, index=frame.index or 0)


class OutlineFiles(Background[Any]):
    """The files of ``sdftrack contour``, written by another thread: a slow disk loses frames of the files alone."""

    def __init__(self, files: ContourFiles, follower: OutlineFollower) -> None:
        self.directory = files.out
        self._failed: OSError | None = None
        self._files, self._follower = files, follower
        super().__init__(lambda item: files.add(*item), WAITING, "outline files")

    def add(self, frame: Any, result: Any, *, im_id: int, shapes: Any = None) -> None:
        """Never waits; OSError once the disk is full."""
        try:
            self.put((im_id, frame.color, self._follower.outline, frame.timestamp), wait=False)
        except OSError as error:
            self._failed = error
            raise

    def close(self) -> None:
        failed = self._failed
        try:
            super().close()
        except OSError as error:
            failed = error
        if failed is None:
            self._files.close()
            return
        with contextlib.suppress(OSError):  # the first error is the one to tell
            self._files.close(str(failed))
        raise failed
