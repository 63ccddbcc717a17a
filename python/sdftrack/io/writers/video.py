# SPDX-License-Identifier: MIT
"""The colour images of a recording as a video, one file for each time that it was begun or continued."""

from __future__ import annotations

import contextlib
import os
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack._internal.files import UnbufferedFile, replacing
from sdftrack.io.datasets.video_images import PERIOD_MS, SHOWN, VideoFile, part_name, parts_in

KEY_EVERY = 15  # images; to read one, at most so many are decoded
ENCODER = "libx264"
# No image refers to a later one, so that each is a packet at once; no distortion that only looks sharper.
OPTIONS = {"preset": "veryfast", "crf": "17", "tune": "psnr,zerolatency", "g": str(KEY_EVERY)}
# A cluster for each image, which goes to the file when the next one comes.
AT_ONCE = {"cluster_time_limit": "1", "flush_packets": "1"}


def has_encoder() -> bool:
    """Whether this build of PyAV can write such a video. ImportError without PyAV."""
    return ENCODER in need("av", "video").codecs_available


def last_image(folder: Path) -> int:
    """The number of the last image that the videos of an interrupted recording hold; -1 without one."""
    numbers = [-1]
    for path in parts_in(folder).values():
        with contextlib.suppress(ValueError):  # cut within its header
            numbers += [
                int(p.time_ns // (1_000_000 * PERIOD_MS)) for t in VideoFile(path).tracks for p in t.packets
            ]
    return max(numbers)


class VideoWriter:
    """Writes images with ascending numbers; an image is in the file when the next one has been added. `last` is the
    number of the last image; of a recording that is continued, what the files have behind it is removed."""

    def __init__(self, folder: Path, last: int | None = None) -> None:
        self._folder, self.last = folder, last
        self._shape: tuple[int, int] | None = None
        self._path = folder / part_name(None)
        self._file: Any = None
        for path in reversed(parts_in(folder).values()):
            if last is not None and _ended(path, last):
                return
            path.unlink()

    def add(self, number: int, image: NDArray[np.uint8]) -> str:
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
            if self._file is None:
                self._begin(number, (even.shape[1], even.shape[0]), shape)
            self._encode(number, even)
        except BaseException:  # a full disk, or Ctrl-C: no later image may refer to this one
            self._cut()
            raise
        self._shape, self.last = shape, number
        return self._path.name

    def _begin(self, number: int, coded: tuple[int, int], shown: tuple[int, int]) -> None:
        import av

        self._path = self._folder / part_name(number if parts_in(self._folder) else None)
        self._file, self._whole, self._count = UnbufferedFile(self._path), 0, 0
        self._output = cast(Any, av.open(cast(Any, self._file), "w", format="matroska", options=AT_ONCE))
        self._output.metadata[SHOWN] = f"{shown[1]}x{shown[0]}"
        stream = self._output.add_stream(ENCODER, rate=30, options=OPTIONS)
        stream.width, stream.height, stream.pix_fmt = *coded, "yuv420p"
        stream.codec_context.time_base, stream.time_base = Fraction(1, 30), Fraction(1, 1000)
        stream.codec_context.thread_count = 1  # the same bits on any machine
        self._stream = stream

    def _encode(self, number: int, image: NDArray[np.uint8]) -> None:
        import av

        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="rgb24")
        frame = frame.reformat(format="yuv420p", interpolation="AREA")  # chroma is the mean of 2 x 2 pixels
        frame.pts, frame.time_base = self._count, Fraction(1, 30)
        (packet,) = self._stream.encode(frame)
        packet.pts = packet.dts = PERIOD_MS * number
        packet.time_base = Fraction(1, 1000)
        self._output.mux(packet)
        self._whole, self._count = self._file.tell(), self._count + 1

    def _cut(self) -> None:
        """End the file with its last whole image; a file without any is removed."""
        if self._file is None:
            return
        with contextlib.suppress(Exception):  # it cannot write its end
            self._output.close()
        self._file.close()
        self._file = None
        if self._count > 1:
            os.truncate(self._path, self._whole)
        else:
            self._path.unlink(missing_ok=True)

    def finish(self) -> None:
        if self._file is not None:
            self._output.close()
            self._file.close()
            self._file = None

    def close(self) -> None:
        self.finish()


def _ended(path: Path, last: int) -> bool:
    import av

    try:
        packets = [packet for track in VideoFile(path).tracks for packet in track.packets]
    except ValueError:  # cut within its header
        return False
    if not any(packet.pts <= PERIOD_MS * last for packet in packets):
        return False
    with (
        replacing(path) as temporary,
        av.open(str(path)) as source,
        av.open(str(temporary), "w", format="matroska", options=AT_ONCE) as out,
    ):
        out.metadata.update(source.metadata)
        stream = out.add_stream_from_template(source.streams.video[0])
        with contextlib.suppress(av.FFmpegError):  # where it was cut
            for packet in source.demux(video=0):
                if packet.size and packet.pts is not None and packet.pts <= PERIOD_MS * last:
                    packet.stream = stream
                    out.mux(packet)
    return True
