# SPDX-License-Identifier: MIT
"""Videos: written completely or not at all, with PyAV such as any browser plays, else by OpenCV; and read."""

from __future__ import annotations

import contextlib
import itertools
import os
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import MissingExtra, need
from sdftrack._internal.files import PART, PART_PREFIX
from sdftrack.io.datasets.images import image_files
from sdftrack.io.frames import read_color

Picture = NDArray[np.uint8]
_ENCODERS = ("libx264", "libopenh264", "h264")
_ENCODER_OPTIONS = {"libx264": {"crf": "20", "preset": "veryfast"}}


class VideoFile:
    """An MP4: H.264 that browsers play (yuv420p, even size, index first) with PyAV, else MPEG-4 Part 2 (mp4v)."""

    def __init__(self, path: Path, fps: float | None) -> None:
        self.part = path.with_name(f".{path.name}{PART}")
        self._name, self._fps = path.name, fps
        self._waiting: list[tuple[Picture, float | None]] = []  # the first picture, until the rate is known
        self._encoder: _BrowserVideo | _PlainVideo | None = None
        self._make: type[_BrowserVideo | _PlainVideo] = _BrowserVideo
        try:
            need("av", "video")
        except MissingExtra as error:
            self._make = _PlainVideo
            told = f"{path.name} is MPEG-4 Part 2 (mp4v), which browsers do not play; for H.264: {error}"
            warnings.warn(told, RuntimeWarning, stacklevel=3)

    def add(self, picture: Picture, stamp: float | None) -> None:
        if self._encoder is not None:
            self._encode(picture)
            return
        self._waiting.append((picture, stamp))
        if self._fps is not None or len(self._waiting) == 2:
            self._open()

    def _open(self) -> None:
        stamps = [s for _, s in self._waiting if s is not None]
        gap = stamps[1] - stamps[0] if len(stamps) == 2 else 0.0
        fps = self._fps or (1 / gap if 1 / 120 <= gap <= 1.0 else 30.0)
        self._height, self._width = (n - n % 2 for n in self._waiting[0][0].shape[:2])
        self._encoder = self._make(self.part, self._name, self._width, self._height, max(1, round(fps)))
        waiting, self._waiting = self._waiting, []
        for picture, _ in waiting:
            self._encode(picture)

    def _encode(self, picture: Picture) -> None:
        assert self._encoder is not None
        self._encoder.add(np.ascontiguousarray(picture[: self._height, : self._width]))

    def finish(self) -> bool:
        """Flush and close; returns whether there is a video."""
        if self._encoder is None and self._waiting:
            self._open()
        if self._encoder is None:
            return False
        self._encoder.finish()
        self._encoder = None
        return True

    def drop(self) -> None:
        with contextlib.suppress(Exception):
            if self._encoder is not None:
                self._encoder.drop()
        self._encoder = None
        self.part.unlink(missing_ok=True)


class _BrowserVideo:
    def __init__(self, part: Path, name: str, width: int, height: int, fps: int) -> None:
        import av

        # `faststart` moves the index to the front, so that a browser plays before it has read all.
        self._container = cast(Any, av.open(str(part), "w", format="mp4", options={"movflags": "faststart"}))
        for encoder in _ENCODERS:
            try:
                self._stream: Any = self._container.add_stream(
                    encoder, rate=fps, options=_ENCODER_OPTIONS.get(encoder, {})
                )
                break
            except (ValueError, av.FFmpegError):
                continue
        else:
            raise RuntimeError(f"{name}: this build of PyAV has no H.264 encoder; record with video=False")
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        self._stream.thread_count = 1  # the same bits on any machine

    def add(self, picture: Picture) -> None:
        import av

        self._container.mux(self._stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))

    def finish(self) -> None:
        self._container.mux(self._stream.encode())
        self._container.close()

    def drop(self) -> None:
        self._container.close()


class _PlainVideo:
    def __init__(self, part: Path, name: str, width: int, height: int, fps: int) -> None:
        import cv2

        self._part, self._name, self._count = part, name, 0
        self._beside = part.with_name(f"{PART_PREFIX}{name}")  # OpenCV chooses the format by the suffix
        codec = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer: Any = cv2.VideoWriter(str(self._beside), codec, fps, (width, height))

    def add(self, picture: Picture) -> None:
        self._writer.write(np.ascontiguousarray(picture[..., ::-1]))
        self._count += 1

    def finish(self) -> None:
        """OSError if the file is not whole, of which OpenCV's writer says nothing."""
        import cv2

        self._writer.release()
        written = int(cv2.VideoCapture(str(self._beside)).get(cv2.CAP_PROP_FRAME_COUNT))
        if written != self._count:
            raise OSError(f"{self._name}: {written} of {self._count} images were written; is the disk full?")
        os.replace(self._beside, self._part)

    def drop(self) -> None:
        self._writer.release()
        self._beside.unlink(missing_ok=True)


def write_video(path: Path, pictures: Iterable[Picture], fps: float) -> None:
    video = VideoFile(path, fps)
    try:
        for picture in pictures:
            video.add(picture, None)
        if video.finish():
            os.replace(video.part, path)
    except BaseException:
        video.drop()
        raise


class ColorVideo:
    """Frames of `source`: ``for image in ColorVideo(path)`` gives (H, W, 3) uint8 RGB. It is a video (anything that
    PyAV reads; extra [video]), or a folder of images in the order of their names or numbers. FileNotFoundError;
    ValueError for a folder without images, and a file that is not a video, or is truncated."""

    def __init__(self, source: str | Path) -> None:
        self.source = Path(source)
        if not self.source.exists():
            raise FileNotFoundError(f"VIDEO: no such file or folder: {source}")
        self.files = image_files(self.source) if self.source.is_dir() else []
        if self.source.is_dir() and not self.files:
            raise ValueError(f"{source}: expected a folder of images, got one without any")
        self.fps: float | None = None
        self.count = len(self.files)  # 0: unknown
        if self.files:
            return
        av = need("av", "video")
        try:
            with av.open(str(self.source)) as container:
                if not container.streams.video:
                    raise ValueError(f"{self.source}: expected a video, got a file without images")
                stream = container.streams.video[0]
                self.count = int(stream.frames)
                self.fps = float(stream.average_rate) if stream.average_rate else None
        except av.FFmpegError as error:
            raise ValueError(f"{self.source}: not a readable video ({error.strerror})") from None

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        if self.files:
            yield from map(read_color, self.files)
            return
        import av

        try:
            with av.open(str(self.source)) as container:
                for frame in container.decode(video=0):
                    yield np.ascontiguousarray(frame.to_ndarray(format="rgb24"))
        except av.FFmpegError as error:
            raise ValueError(f"{self.source}: the video cannot be read further ({error.strerror})") from None

    def frames(
        self, start: int = 0, stop: int | None = None, step: int = 1
    ) -> Iterator[tuple[int, NDArray[np.uint8] | ValueError | OSError]]:
        """Numbers and images of a range of frames; an exception object instead of an unreadable image of a folder."""
        if not self.files:
            yield from itertools.islice(enumerate(self), start, stop, step)
            return
        for number in range(len(self.files))[start:stop:step]:
            try:
                yield number, read_color(self.files[number])
            except (ValueError, OSError) as error:
                yield number, error
