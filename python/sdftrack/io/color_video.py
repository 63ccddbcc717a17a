# SPDX-License-Identifier: MIT
"""Colour frames of a video file or an image folder."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack.io.datasets.images import image_files
from sdftrack.io.frames import read_color

__all__ = ["ColorVideo"]


class ColorVideo:
    """Frames of `source`: ``for image in ColorVideo(path)`` gives (H, W, 3) uint8 RGB.

    Parameters
    ----------
    source : path
        A video (anything that PyAV reads; extra [video]), or a folder of images in the order of their names or numbers.

    Raises
    ------
    FileNotFoundError
        `source` does not exist.
    ValueError
        No images in the folder; a file that is not a video, or is truncated.
    """

    def __init__(self, source: str | Path) -> None:
        self.source = Path(source)
        if not self.source.exists():
            raise FileNotFoundError(f"VIDEO: no such file or folder: {source}")
        self.files = image_files(self.source) if self.source.is_dir() else []
        if self.source.is_dir() and not self.files:
            raise ValueError(f"{source}: expected a folder of images, got one without any")
        self.fps: float | None = None
        self.count = len(self.files)  # 0: unknown
        if not self.files:
            self._look()

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        if self.files:
            for file in self.files:
                yield read_color(file)
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
        """Numbers and images of a range of frames; an exception object instead of an unreadable image of a folder.

        >>> for number, image in ColorVideo(path).frames(step=2): ...  # doctest: +SKIP
        """
        if not self.files:
            yield from itertools.islice(enumerate(self), start, stop, step)
            return
        for number in range(len(self.files))[start:stop:step]:
            try:
                yield number, read_color(self.files[number])
            except (ValueError, OSError) as error:
                yield number, error

    def _look(self) -> None:
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
