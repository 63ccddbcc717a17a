# SPDX-License-Identifier: MIT
"""Videos that any browser plays, written completely or not at all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["PART", "VideoFile", "write_video"]

PART = ".part"  # suffix of a file that is not finished
_ENCODERS = ("libx264", "libopenh264", "h264")
_ENCODER_OPTIONS = {"libx264": {"crf": "20", "preset": "veryfast"}}


class VideoFile:
    """H.264 in an MP4 that browsers play: yuv420p, even size, index first."""

    def __init__(self, path: Path, fps: float | None) -> None:
        self.part = path.with_name(f".{path.name}{PART}")
        self._name = path.name
        self._fps = fps
        self._waiting: list[tuple[Any, float | None]] = []  # the first picture, until the rate is known
        self._container: Any = None
        self._stream: Any = None

    def add(self, picture: NDArray[np.uint8], stamp: float | None) -> None:
        if self._container is not None:
            self._encode(picture)
            return
        self._waiting.append((picture, stamp))
        if self._fps is not None or len(self._waiting) == 2:
            self._open()

    def _open(self) -> None:
        import av

        stamps = [s for _, s in self._waiting if s is not None]
        gap = stamps[1] - stamps[0] if len(stamps) == 2 else 0.0
        fps = self._fps or (1 / gap if 1 / 120 <= gap <= 1.0 else 30.0)
        # `faststart` moves the index to the front, so that a browser plays before it has read all.
        self._container = av.open(str(self.part), "w", format="mp4", options={"movflags": "faststart"})
        for name in _ENCODERS:
            try:
                self._stream = self._container.add_stream(
                    name, rate=max(1, round(fps)), options=_ENCODER_OPTIONS.get(name, {})
                )
                break
            except (ValueError, av.FFmpegError):
                continue
        else:
            raise RuntimeError(
                f"{self._name}: this build of PyAV has no H.264 encoder; record with video=False"
            )
        height, width = (n - n % 2 for n in self._waiting[0][0].shape[:2])
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        self._stream.thread_count = 1  # the same bits on any machine
        waiting, self._waiting = self._waiting, []
        for picture, _ in waiting:
            self._encode(picture)

    def _encode(self, picture: NDArray[np.uint8]) -> None:
        import av

        even = np.ascontiguousarray(picture[: self._stream.height, : self._stream.width])
        for packet in self._stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")):
            self._container.mux(packet)

    def finish(self) -> bool:
        """Flush and close; returns whether there is a video."""
        if self._container is None and self._waiting:
            self._open()
        if self._container is None:
            return False
        for packet in self._stream.encode():
            self._container.mux(packet)
        container, self._container = self._container, None
        container.close()
        return True

    def drop(self) -> None:
        with contextlib.suppress(Exception):
            if self._container is not None:
                self._container.close()
        self._container = None
        self.part.unlink(missing_ok=True)


def write_video(path: Path, pictures: Iterable[NDArray[np.uint8]], fps: float) -> None:
    """Write images (H x W x 3 RGB, of one size) as a video; no file is left if one of them fails."""
    video = VideoFile(path, fps)
    try:
        for picture in pictures:
            video.add(picture, None)
        if video.finish():
            os.replace(video.part, path)
    except BaseException:
        video.drop()
        raise
