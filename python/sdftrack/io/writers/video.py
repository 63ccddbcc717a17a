# SPDX-License-Identifier: MIT
"""The colour images of a recording as a video, one file for each time that it was begun or continued."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.matroska import MatroskaFile
from sdftrack.io.h264 import H264Encoder
from sdftrack.io.matroska_output import MatroskaOutput, state_duration
from sdftrack.io.video_parts import CODEC, PERIOD_MS, part_name, parts_in

__all__ = ["VideoWriter"]


class VideoWriter:
    """Writes images with ascending numbers; an image is in the file when `add` returns.

    Parameters
    ----------
    folder : Path
    last : int, optional
        Where a recording is continued: the number of its last image; what the files have behind it is removed.

    Attributes
    ----------
    last : int or None
        The number of the last image.
    """

    def __init__(self, folder: Path, last: int | None = None) -> None:
        self._folder, self.last = folder, last
        self._output: MatroskaOutput | None = None
        self._encoder: H264Encoder | None = None
        self._shape: tuple[int, int] | None = None
        self._path = folder / part_name(None)
        for path in reversed(parts_in(folder).values()):
            if last is not None and _ended(path, last):
                return
            path.unlink()
        if last is not None:
            warnings.warn(f"{folder}: the video of the images up to {last} is lost", stacklevel=4)

    def add(self, number: int, image: NDArray[np.uint8]) -> str:
        """Write an image; returns the name of its file."""
        if self.last is not None and number <= self.last:
            raise ValueError(
                f"color: a video needs images with ascending numbers, got {number} after {self.last}; use png or jpg"
            )
        shape = (image.shape[0], image.shape[1])
        before = self._shape or shape
        if shape != before:
            raise ValueError(
                f"color: image {number} has {shape[1]} x {shape[0]} pixels, those before {before[1]} x {before[0]}, "
                "and a video has one size; use png or jpg"
            )
        even = np.pad(image, [(0, shape[0] % 2), (0, shape[1] % 2), (0, 0)], mode="edge")
        try:
            if self._encoder is None:
                self._encoder = H264Encoder(even.shape[1], even.shape[0])
            packet, key = self._encoder.encode(even)
            if self._output is None:
                self._begin(number, self._encoder.private, even.shape, shape)
            assert self._output is not None
            self._output.add(PERIOD_MS * number, packet, key)
        except BaseException:  # a full disk, or Ctrl-C: no later image may refer to this one
            self._encoder = None
            raise
        self._shape, self.last = shape, number
        return self._path.name

    def _begin(self, number: int, private: bytes, coded: tuple[int, ...], shown: tuple[int, int]) -> None:
        self._path = self._folder / part_name(number if parts_in(self._folder) else None)
        self._output = MatroskaOutput(
            self._path, CODEC, private, (coded[1], coded[0]), (shown[1], shown[0]), PERIOD_MS
        )

    def finish(self) -> None:
        if self._output is not None:
            self._output.finish(0 if self.last is None else PERIOD_MS * (self.last + 1))
            self._output = None

    def close(self) -> None:
        """End without `finish`, to be continued."""
        if self._output is not None:
            self._output.close()
            self._output = None


def _ended(path: Path, last: int) -> bool:
    """End a file that was not finished with image `last`; False if it has no image up to that one."""
    try:
        file = MatroskaFile(path)
    except ValueError:  # cut within its header
        return False
    blocks = [block for track in file.tracks.values() for block in track.blocks]
    file.close()
    kept = [block for block in blocks if block.time_ns <= 1_000_000 * PERIOD_MS * last]
    if not kept:
        return False
    found = kept[-1].time_ns // (1_000_000 * PERIOD_MS)
    if found < last:
        warnings.warn(
            f"{path}: the video ends at image {found} of {last}; what was written behind it is lost",
            stacklevel=4,
        )
    os.truncate(path, kept[-1].end)
    state_duration(path, PERIOD_MS * (found + 1))
    return True
