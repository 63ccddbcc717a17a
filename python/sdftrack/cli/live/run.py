# SPDX-License-Identifier: MIT
"""The loop of `sdftrack live`: a frame, what the user asked for, a result, everything that receives it, and files."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack._internal.background import Background
from sdftrack.cli.followed import StatusCounts
from sdftrack.cli.live.followers import Follower, ReconstructorFollower, has
from sdftrack.cli.progress import PLAIN_EVERY_S
from sdftrack.cli.record import opened
from sdftrack.io.frames import write_color
from sdftrack.io.writers import Contents
from sdftrack.motion.live import LiveMotion, LiveValues
from sdftrack.viz.viewer import Box, Click, Pause, Record, Save

KEPT = 4096  # ages of the newest frames, for the percentiles
MESH_EVERY_S = 2.0  # of a growing shape; and of the copy of it that pictures show, which takes milliseconds
COPY_EVERY_S = 0.5
NO_DEPTH = "to record, follow an object by depth: these frames have colour alone"


class Statistics:
    def __init__(self, objects: int) -> None:
        self.frames = 0
        self.followed = [0] * objects  # frames in which an object was "ok" or "weak"
        self._counts = StatusCounts()
        self._ages_s: deque[float] = deque(maxlen=KEPT)

    def add(self, result: Any, age_s: float) -> None:
        self.frames += 1
        self._counts.add(result)
        for k, status in enumerate(result.status):
            self.followed[k] += str(status) in ("ok", "weak")
        if math.isfinite(age_s):
            self._ages_s.append(age_s)

    def line(self, seconds: float, camera: Any) -> str:
        parts = [f"{self.frames} frames", f"{self.frames / max(seconds, 1e-9):.1f}/s"]
        if self._ages_s:
            middle, most = 1e3 * np.percentile(self._ages_s, (50, 99))
            parts.append(f"{middle:.1f} ms old (99 %: {most:.1f})")
        parts += [f"{camera.dropped} dropped", self._counts()]
        return ", ".join(p for p in parts if p)


class Run:
    """Runs a follower on the frames of a camera.

    `new_recorder` is called with the first result, so that a start that fails leaves nothing behind.
    """

    def __init__(
        self, camera: Any, follower: Follower, viewer: Any, streams: list[Any],
        new_recorder: Callable[[], Any] | None, files: LiveFiles, quiet: bool, motion: bool = False,
    ) -> None:  # fmt: skip
        self._motions = [LiveMotion() for _ in follower.names] if motion else []
        self.movements: list[LiveValues] = []
        self.camera, self.follower, self.viewer = camera, follower, viewer
        self.streams, self.files = streams, files
        self.recorder: Any = None
        self._new_recorder = new_recorder
        self.statistics = Statistics(len(follower.names))
        self._quiet, self._paused, self._asked = quiet, False, ""
        grows = isinstance(follower, ReconstructorFollower) and viewer is not None
        self._meshes: Background[Any] | None = (
            Background(lambda shape: viewer.set_mesh(0, shape.to_mesh()), 1, "mesh") if grows else None
        )
        self._mesh_due = self._copy_due = 0.0
        self._copy: list[Any] | None = None

    def run(self, seconds: float | None = None) -> None:
        try:
            for frame in self._frames(seconds):
                self.step(frame)
        finally:
            with contextlib.ExitStack() as stack:
                for part in (self._meshes, self.recorder, self.files):
                    if part is not None:
                        stack.callback(part.close)
                if isinstance(self.follower, ReconstructorFollower) and self.recorder is not None:
                    self._tell(self._save())

    @property
    def lost(self) -> list[str]:
        counted = zip(self.follower.names, self.statistics.followed, strict=True)
        return [name for name, count in counted if self.statistics.frames and not count]

    def tell(self, seconds: float) -> None:
        print(self.statistics.line(seconds, self.camera))
        for name, values in zip(self.follower.names, self.movements, strict=False):
            print(f"{name}: {values.text()}")
        for one in self.streams:
            print(
                f"{one.address}: {one.sent} messages sent, {one.dropped} dropped{one.error and '; ' + one.error}"
            )
        if self.recorder is not None:
            lost = getattr(self.recorder, "dropped", 0)
            print(f"written to {self.recorder.directory}{f', {lost} frames left out' if lost else ''}")

    def step(self, frame: Any) -> Any:
        """Process one frame; returns its result, or None if nothing is followed."""
        result = self._answer(frame)
        if result is None and not self._paused:
            result = self._follow(frame)
        age_s = self.camera.age_s(frame)
        self._tell(self.files.add(frame))
        if result is not None:
            if not self.statistics.frames:
                self.camera.resume()
            self.statistics.add(result, age_s)
            moved = self._move(frame, result)
            for stream in self.streams:
                stream.send(frame, result, moved)
            if self.recorder is None and self._new_recorder is not None:
                self.recorder = self._new_recorder()
            if self.recorder is not None:
                self.recorder.add(frame, result, im_id=self.statistics.frames - 1, shapes=self._growing())
        if self.viewer is not None:
            dropped, grown = self.camera.dropped, self._growing()
            mask = None if result is None else self.follower.mask
            lines = [f"{n}: {v.text()}" for n, v in zip(self.follower.names, self.movements, strict=False)]
            self.viewer.show(
                frame, result, latency_s=age_s, dropped=dropped, shapes=grown, mask=mask, notes=lines
            )
            now = time.monotonic()
            if self._meshes is not None and now >= self._mesh_due and self.viewer.pages:
                for shape in grown or ():
                    self._meshes.put(shape, wait=False)
                    self._mesh_due = now + MESH_EVERY_S
        return result

    def _move(self, frame: Any, result: Any) -> list[dict[str, Any]] | None:
        """Running values of the movements, for the streams."""
        if not self._motions:
            return None
        seen = [s in ("ok", "weak") for s in result.status]
        seconds = time.monotonic() if frame.timestamp is None else float(frame.timestamp)
        self.movements = [
            motion.add(seconds, pose[:3, 3] if found else None)
            for motion, pose, found in zip(self._motions, result.poses, seen, strict=True)
        ]
        return [v.to_dict() for v in self.movements]

    def _follow(self, frame: Any) -> Any:
        try:
            result = self.follower.step(frame)
        except ValueError as error:  # a start that failed: the user can try another place
            if self.viewer is None:
                raise
            self._ask(str(error))
            return None
        if result is None:
            missing = self.follower.missing
            self._ask(f"{self.follower.start_by} the object: {missing[0]}" if missing else "")
        return result

    def _answer(self, frame: Any) -> Any:
        result = None
        for request in self.viewer.requests() if self.viewer is not None else ():
            try:
                if isinstance(request, Click | Box):
                    result = self._start(frame, request)
                elif isinstance(request, Pause):
                    self._paused = request.on
                elif isinstance(request, Record):
                    colored = request.on and frame.depth is None and not frame.error
                    self._tell(NO_DEPTH if colored else self.files.record(request.on))
                elif isinstance(request, Save):
                    self._tell(self._save())
            except (ValueError, OSError) as error:
                self._tell(str(error))
        return result

    def _start(self, frame: Any, request: Click | Box) -> Any:
        if not has(frame, self.follower.needs):
            raise ValueError(f"this frame has no {self.follower.needs} image; try again")
        place: tuple[float, ...] = (
            (request.x_px, request.y_px)
            if isinstance(request, Click)
            else (request.x, request.y, request.w, request.h)
        )
        result = self.follower.start(frame, request.k, place)
        self._paused = False
        self._tell(f"{self.follower.names[request.k]}: started")
        self._asked = ""
        return result

    def _save(self) -> str:
        if isinstance(self.follower, ReconstructorFollower):
            if self.follower.missing:
                return "nothing to save yet: click on the object"
            return self.files.save("mesh", ".ply", self.follower.star.mesh().save)
        picture = self.viewer.picture
        if picture is None:
            return "nothing to save yet"
        return self.files.save("picture", ".png", lambda path: write_color(path, picture))

    def _ask(self, asked: str) -> None:
        if asked != self._asked:
            self._asked = asked
            self._tell(asked)

    def _tell(self, text: str) -> None:
        if not text:
            return
        if self.viewer is not None:
            self.viewer.tell(text)
        if not self._quiet:
            print(text, file=sys.stderr, flush=True)

    def _growing(self) -> list[Any] | None:
        if not isinstance(self.follower, ReconstructorFollower) or self.follower.missing:
            return None
        drawn = self.recorder is not None or (self.viewer is not None and self.viewer.pages)
        now = time.monotonic()
        if drawn and now >= self._copy_due:
            self._copy, self._copy_due = self.follower.shapes, now + COPY_EVERY_S
        return self._copy

    def _frames(self, seconds: float | None) -> Iterator[Any]:
        began = told = time.monotonic()
        for frame in self.camera:
            yield frame
            now = time.monotonic()
            if seconds is not None and now - began >= seconds:
                return
            if not self._quiet and now - told > PLAIN_EVERY_S:
                print(self.statistics.line(now - began, self.camera), file=sys.stderr, flush=True)
                told = now


WAITING = 30  # frames that may wait for the disk


class RawRecording(Background[Any]):
    def __init__(self, folder: Path, camera: Any) -> None:
        self.folder = folder
        self._writer = opened(folder, Contents(camera))
        super().__init__(self._writer.add, WAITING, "recording")

    def close(self) -> None:
        """Finish what was written, also after an error."""
        try:
            super().close()
        finally:
            with contextlib.suppress(ValueError):
                self._writer.finish()


class LiveFiles:
    """Everything below --out; without it nothing is written, and requests are answered by saying so."""

    def __init__(self, out: Path | None, camera: Any) -> None:
        self._out, self._camera = out, camera
        self._raw: RawRecording | None = None
        self._counts = Counter[str]()

    def record(self, on: bool) -> str:
        if self._out is None:
            return "to record, start with --out DIR"
        if on == (self._raw is not None):
            return ""
        if on:
            self._raw = RawRecording(self._new("recording"), self._camera)
            return f"recording to {self._raw.folder}"
        return self._end()

    def add(self, frame: Any) -> str:
        if self._raw is None or frame.error:
            return ""
        try:
            self._raw.put(frame, wait=False)
        except OSError as error:
            return f"{error}; {self._end()}"
        return ""

    def save(self, what: str, suffix: str, write: Callable[[Path], object]) -> str:
        if self._out is None:
            return "to save, start with --out DIR"
        path = self._new(what, suffix)
        write(path)
        return f"saved {path}"

    def close(self) -> None:
        if self._raw is not None:
            with contextlib.suppress(OSError):
                self._end()

    def _end(self) -> str:
        raw, self._raw = self._raw, None
        assert raw is not None
        with contextlib.suppress(OSError):  # told by `add`; what was written is kept
            raw.close()
        lost = f", {raw.dropped} frames dropped" if raw.dropped else ""
        return f"recorded {raw.folder}{lost}"

    def _new(self, what: str, suffix: str = "") -> Path:
        assert self._out is not None
        self._out.mkdir(parents=True, exist_ok=True)
        while True:
            self._counts[what] += 1
            path = self._out / f"{what}_{self._counts[what]}{suffix}"
            if not path.exists():
                return path
