# SPDX-License-Identifier: MIT
"""The colour images of a folder that has them as a video: any one by its number, neighbours without a search."""

from __future__ import annotations

import mmap
import warnings
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.matroska import MatroskaFile
from sdftrack.io.h264 import H264Decoder
from sdftrack.io.video_parts import CODEC, PERIOD_MS, part_name, parts_in

__all__ = ["VideoImage", "VideoImages"]

PERIOD_NS = 1_000_000 * PERIOD_MS
MOST_NS = 2**62  # of a time; damaged ones are larger


class VideoImages:
    """The images in ``color.mkv`` and its continuations; `number in images` says whether there is one.

    One thread at a time reads. The files are opened at the first image, also again after `close` or in a process that
    was given the object.

    Raises
    ------
    ValueError
        A file that is not such a video.
    """

    def __init__(self, root: Path) -> None:
        self._parts = {first: _Part(path, max(first, 0)) for first, path in parts_in(root).items()}
        self._lock = Lock()
        first = min(self._parts, default=-1)
        if first >= 0:
            warnings.warn(
                f"{root / part_name(None)}: the video is missing: frames before image {first} have no colour",
                stacklevel=5,
            )

    @staticmethod
    def of(root: Path) -> VideoImages | None:
        """Those of a folder, None without a video."""
        return VideoImages(root) if parts_in(root) else None

    def __contains__(self, number: int) -> bool:
        part = self._part(number)
        return part is not None and part.place(number) is not None

    def read(self, number: int) -> NDArray[np.uint8]:
        """(H, W, 3) uint8 RGB; ValueError if it cannot be decoded, or is not there."""
        part = self._part(number)
        place = None if part is None else part.place(number)
        if part is None or place is None:
            raise ValueError(f"image {number} is missing")
        with self._lock:
            return part.read(place)

    def close(self) -> None:
        with self._lock:
            for part in self._parts.values():
                part.close()

    def _part(self, number: int) -> _Part | None:
        """The last file that begins at this image or before: a continuation replaces what was behind its beginning."""
        return next((part for first, part in reversed(self._parts.items()) if first <= number), None)

    def __getstate__(self) -> dict[str, Any]:
        return {"_parts": self._parts}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._parts, self._lock = state["_parts"], Lock()


@dataclass(frozen=True)
class VideoImage:
    """One image of a video, in the place of the path of an image file."""

    video: VideoImages
    number: int

    def is_file(self) -> bool:
        return self.number in self.video

    def read(self) -> NDArray[np.uint8]:
        try:
            return self.video.read(self.number)
        except ValueError as error:
            raise ValueError(f"{self}: {error}") from None

    def __str__(self) -> str:
        return f"the video, image {self.number}"


class _Part:
    """One file. Its index stays in memory, the file itself is mapped while it is read."""

    _data: Any  # the file, mapped
    _decoder: H264Decoder | None
    _frame: Any  # the image decoded last
    _next: int  # the place of the image that the decoder takes next, -1 for none

    def __init__(self, path: Path, first: int) -> None:
        self._path = path
        try:
            file = MatroskaFile(path)
        except ValueError as error:
            raise ValueError(f"{error}; without the file, the depth images can be read alone") from None
        file.close()
        track = next(iter(file.tracks.values()), None)
        blocks = [] if track is None else track.blocks
        times = np.array([min(block.time_ns, MOST_NS) for block in blocks], np.int64)
        self._spans = [(block.start, block.end) for block in blocks]
        self._keys = np.array([n for n, block in enumerate(blocks) if block.key], np.int64)
        in_order = all(a[1] <= b[0] for a, b in zip(self._spans, self._spans[1:], strict=False))
        if (
            track is None
            or track.codec != CODEC
            or (times % PERIOD_NS).any()
            or not in_order
            or not (blocks == [] or blocks[0].key)
        ):
            raise ValueError(
                f"{path}: expected a video as sdftrack writes it, got another one; without the file, the depth images "
                "can be read alone"
            )
        self._numbers = times // PERIOD_NS
        self._private = track.private
        self._shown = (track.height - track.cropped[1], track.width - track.cropped[0])
        self._forget()
        have, stated = int(self._numbers[-1]) + 1 if blocks else first, file.duration_ns // PERIOD_NS
        if stated > have:
            warnings.warn(
                f"{path}: the video is cut: images {have} to {stated - 1} are missing, and their frames have no colour",
                stacklevel=6,
            )

    def place(self, number: int) -> int | None:
        at = int(np.searchsorted(self._numbers, number))
        return at if at < len(self._numbers) and self._numbers[at] == number else None

    def read(self, place: int) -> NDArray[np.uint8]:
        if self._data is None:
            with self._path.open("rb") as file:
                self._data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        if place + 1 != self._next:
            self._go_to(place)
        h, w = self._shown
        return np.ascontiguousarray(self._frame.to_ndarray(format="rgb24")[:h, :w])

    def _go_to(self, place: int) -> None:
        """Decode up to an image: on from the last one, or from the nearest one before that needs no other."""
        key = int(self._keys[np.searchsorted(self._keys, place, "right") - 1])
        begin = self._next if key <= self._next <= place else key
        if begin == key or self._decoder is None:
            self._decoder, begin = H264Decoder(self._private), key
        self._next = -1  # if it fails, the next one begins anew
        for start, end in self._spans[begin : place + 1]:
            self._frame = self._decoder.decode(self._data[start:end])
        self._next = place + 1

    def close(self) -> None:
        if self._data is not None:
            self._data.close()
        self._forget()

    def _forget(self) -> None:
        self._data = self._decoder = self._frame = None
        self._next = -1

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        state.update(_data=None, _decoder=None, _frame=None, _next=-1)
        return state
