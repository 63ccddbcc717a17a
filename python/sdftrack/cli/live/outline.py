# SPDX-License-Identifier: MIT
"""`sdftrack live --contour`: an outline in the colour images of any camera, and its files."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import sdftrack as st
from sdftrack._internal.background import Background
from sdftrack.cli.contour_files import ContourFiles, bad_frame, trouble_of
from sdftrack.cli.init import Init, place_of
from sdftrack.cli.live.followers import NO_COLOR, Follower
from sdftrack.io.report_file import result_of

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
        self._tracker, self._init = tracker, init

    @property
    def options(self) -> dict[str, Any]:
        return dict(self._tracker.options)

    @property
    def mask(self) -> Any:
        """(H, W) bool: the object's pixels in the last frame; None if that was not started or had no image."""
        usable = self.outline is not None and self.outline.status != "bad_frame"
        return self.outline.mask if usable else None

    def frames_of(self, camera: Any) -> Any:
        return ColorAlone(camera)

    def step(self, frame: Any) -> Any:
        if self.outline is None:
            if self._init is None or frame.color is None:
                return None
            return self._start(frame, **place_of(self._init, frame.shape, "colour"))
        trouble = frame.error if frame.color is None else trouble_of(frame.color, self.outline)
        if trouble:
            self.outline = bad_frame(self.outline, trouble)
        else:
            self.outline = self._tracker.track(frame.color)
        return self._told(frame)

    def click(self, frame: Any, k: int, px: tuple[float, float]) -> Any:
        raise ValueError("drag a box around the object: a click does not tell its size")

    def box(self, frame: Any, k: int, box: tuple[float, float, float, float]) -> Any:
        return self._start(frame, box=box)

    def _start(self, frame: Any, **where: Any) -> Any:
        self.outline = self._tracker.start(frame.color, **where)
        self._started = True
        return self._told(frame)

    def _told(self, frame: Any) -> Any:
        now = self.outline
        row = {"pose": None, "status": now.status, "reason": now.reason, "confidence": now.confidence}
        result = result_of({"objects": [row], "timestamp": frame.timestamp})
        return dataclasses.replace(result, index=frame.index or 0)


class OutlineFiles:
    """The files of ``sdftrack contour``, written by another thread: a slow disk loses frames of the files alone."""

    def __init__(self, files: ContourFiles, follower: OutlineFollower) -> None:
        self.directory = files.out
        self._failed: OSError | None = None
        self._files, self._follower = files, follower
        self._work: Background[Any] = Background(lambda item: files.add(*item), WAITING, "outline files")

    @property
    def dropped(self) -> int:
        return self._work.dropped

    def add(self, frame: Any, result: Any, *, im_id: int, shapes: Any = None) -> None:
        """Never waits; OSError once the disk is full."""
        item = (im_id, frame.color, self._follower.outline, frame.timestamp)
        try:
            self._work.put(item, wait=False)
        except OSError as error:
            self._failed = error
            raise

    def close(self) -> None:
        failed = self._failed
        try:
            self._work.close()
        except OSError as error:
            failed = error
        if failed is None:
            self._files.close()
            return
        with contextlib.suppress(OSError):  # the first error is the one to tell
            self._files.close(str(failed))
        raise failed
