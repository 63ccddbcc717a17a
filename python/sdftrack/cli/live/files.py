# SPDX-License-Identifier: MIT
"""Files of `sdftrack live` besides the results: recordings that the user begins and ends, meshes, pictures."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sdftrack._internal.background import Background
from sdftrack.cli.recording import opened
from sdftrack.io.writers import Contents

WAITING = 30  # frames that may wait for the disk


class RawRecording(Background[Any]):
    """The camera's frames in a folder of their own, written by another thread."""

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
        """Begin or end a recording of the frames; returns what to tell the user."""
        if self._out is None:
            return "to record, start with --out DIR"
        if on == (self._raw is not None):
            return ""
        if on:
            self._raw = RawRecording(self._new("recording"), self._camera)
            return f"recording to {self._raw.folder}"
        return self._end()

    def add(self, frame: Any) -> str:
        """Record a frame, if that was asked for; returns what to tell the user."""
        if self._raw is None or frame.error:
            return ""
        try:
            self._raw.put(frame, wait=False)
        except OSError as error:
            return f"{error}; {self._end()}"
        return ""

    def save(self, what: str, suffix: str, write: Callable[[Path], object]) -> str:
        """Let `write` make a new file; returns what to tell the user."""
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
