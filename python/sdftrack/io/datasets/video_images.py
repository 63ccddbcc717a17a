# SPDX-License-Identifier: MIT
"""The colour images of a folder that has them as a video: any one by its number, neighbours without a search.
``color.mkv`` has the images of a recording, and ``color_000123.mkv`` those from image 123 on, where it was continued.
The time of an image in a file is its number in the layout times `PERIOD_MS`, so that an image that is missing leaves a
gap and moves no other. Times of the recording are in the files of its layout."""

from __future__ import annotations

import contextlib
import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need

PERIOD_MS = 33
PERIOD_NS = 1_000_000 * PERIOD_MS
SHOWN = "SHOWN"  # tag: width x height in pixels, of images of odd size less than is encoded
MOST_BETWEEN = 40  # bytes between two images of a file that is not damaged: 20 to 24, and 38 of any Matroska
MOST_NS = 2**62  # of a time; damaged ones are larger
_NAME = re.compile(r"color(?:_(\d{6,}))?\.mkv")


def part_name(first: int | None) -> str:
    """The file that begins with image `first`; None: the first file."""
    return "color.mkv" if first is None else f"color_{first:06d}.mkv"


def is_part(name: str) -> bool:
    return _NAME.fullmatch(name) is not None


def parts_in(folder: Path) -> dict[int, Path]:
    found = {}
    for path in folder.iterdir() if folder.is_dir() else ():
        name = _NAME.fullmatch(path.name)
        if name:
            found[-1 if name[1] is None else int(name[1])] = path
    return dict(sorted(found.items()))


class VideoImages:
    """The images in ``color.mkv`` and its continuations; `number in images` says whether there is one. One thread at a
    time reads. The files are opened at the first image, also again after `close` or in a process that was given the
    object. ValueError for a file that is not such a video."""

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
    """One file. Its index stays in memory, the file itself is open while it is read."""

    def __init__(self, path: Path, first: int) -> None:
        try:
            file = VideoFile(path)
        except ValueError as error:
            raise ValueError(f"{error}; without the file, the depth images can be read alone") from None
        track = file.tracks[0] if file.tracks else None
        shown = re.fullmatch(r"(\d+)x(\d+)", file.tags.get(SHOWN, ""))
        packets = [] if track is None else _until_damage(track)
        if (
            track is None
            or shown is None
            or track.codec != "h264"
            or any(packet.time_ns % PERIOD_NS or not 0 <= packet.time_ns < MOST_NS for packet in packets)
            or not (packets == [] or packets[0].key)
        ):
            raise ValueError(
                f"{path}: expected a video as sdftrack writes it, got another one; without the file, the depth images "
                "can be read alone"
            )
        self._track = track
        self._numbers = np.array([packet.time_ns // PERIOD_NS for packet in packets], np.int64)
        self._keys = np.array([n for n, packet in enumerate(packets) if packet.key], np.int64)
        self._shown = (int(shown[2]), int(shown[1]))
        self._frame: Any = None  # the image decoded last
        self._next = -1  # the place of the image that the decoder takes next, -1 for none
        have, stated = int(self._numbers[-1]) + 1 if packets else first, file.duration_ns // PERIOD_NS
        if stated > have:
            warnings.warn(
                f"{path}: the video is cut: images {have} to {stated - 1} are missing, and their frames have no colour",
                stacklevel=6,
            )

    def place(self, number: int) -> int | None:
        at = int(np.searchsorted(self._numbers, number))
        return at if at < len(self._numbers) and self._numbers[at] == number else None

    def read(self, place: int) -> NDArray[np.uint8]:
        if place + 1 != self._next:
            self._go_to(place)
        h, w = self._shown
        return np.ascontiguousarray(self._frame.to_ndarray(format="rgb24")[:h, :w])

    def _go_to(self, place: int) -> None:
        """Decode up to an image: on from the last one, or from the nearest one before that needs no other."""
        key = int(self._keys[np.searchsorted(self._keys, place, "right") - 1])
        begin = self._next if key <= self._next <= place else key
        self._next = -1
        try:
            for n in range(begin, place + 1):
                self._frame = decode(self._track.read(n))
        except ValueError:
            self.close()  # the next one begins anew
            raise
        self._next = place + 1

    def close(self) -> None:
        self._track.close()
        self._frame, self._next = None, -1

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_frame": None, "_next": -1}


def decode(packet: Any) -> Any:
    import av

    try:
        frames = packet.decode()
    except av.FFmpegError as error:
        raise ValueError(f"it cannot be decoded ({error.strerror})") from None
    if len(frames) != 1 or frames[0].is_corrupt:
        raise ValueError("it cannot be decoded")
    return frames[0]


def _until_damage(track: Track) -> list[Any]:
    """The packets up to the first that does not follow its predecessor: what refers to one that is lost is wrong."""
    for n, (one, other) in enumerate(zip(track.packets, track.packets[1:], strict=False), 1):
        if not 0 <= other.start - one.start - one.size <= MOST_BETWEEN:
            return track.packets[:n]
    return track.packets


class Packet(NamedTuple):
    """One image of a track: its time, where it begins in the file, its bytes, and whether it needs no other one."""

    pts: int  # in the track's unit
    time_ns: int
    start: int
    size: int
    key: bool


@dataclass
class Track:
    """A track of a file, its packets in the order of their times. The file is open from the first `read` to `close`."""

    path: Path
    number: int
    name: str
    codec: str
    fourcc: str
    width: int
    height: int
    packets: list[Packet] = field(default_factory=list)
    _container: Any = None
    _left: Any = None  # packets behind the last one
    _next: int = -1

    def read(self, n: int) -> Any:
        av = need("av", "video")
        try:
            if self._container is None:
                self._container = av.open(str(self.path))
                context = self._container.streams[self.number].codec_context
                context.thread_count = 1  # threads would hold images back
                context.options = {"err_detect": "explode"}  # instead of inventing what is damaged
            if n != self._next:
                stream = self._container.streams[self.number]
                self._container.seek(self.packets[n].pts, stream=stream)
                self._left = self._container.demux(stream)
            packet = next(p for p in self._left if p.pts is None or p.pts >= self.packets[n].pts)
        except (av.FFmpegError, StopIteration) as error:
            self.close()
            raise ValueError(f"it cannot be read ({error or 'it is missing'})") from None
        self._next = n + 1
        if packet.pts != self.packets[n].pts or packet.is_corrupt:
            self.close()
            raise ValueError("it is damaged")
        return packet

    def close(self) -> None:
        if self._container is not None:
            self._container.close()
        self._container, self._left, self._next = None, None, -1

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_container": None, "_left": None, "_next": -1}


class VideoFile:
    """The contents of a file, which is read once: tracks of images, tags and attachments by name. `duration_ns` is 0 if
    it is not stated, as of a recording that was interrupted. ValueError for another file; one that is cut has the
    packets before the cut."""

    def __init__(self, path: Path) -> None:
        av = need("av", "video")
        try:
            with av.open(str(path)) as container:
                self.tracks = [_track(path, stream) for stream in container.streams.video]
                self.tags = {name.upper(): text for name, text in container.metadata.items()}
                self.attachments = {
                    s.name: bytes(s.data) for s in container.streams if s.type == "attachment"
                }
                self.duration_ns = 1000 * (container.duration or 0)
                by_number = {track.number: track for track in self.tracks}
                with contextlib.suppress(av.FFmpegError):  # what comes before the damage is whole
                    for packet in container.demux(*container.streams.video):
                        if packet.size and packet.pts is not None and not packet.is_corrupt:
                            own = by_number[packet.stream.index].packets
                            time_ns = round(packet.pts * packet.time_base * 10**9)
                            key = packet.is_keyframe
                            own.append(Packet(packet.pts, time_ns, packet.pos, packet.size, key))
        except av.FFmpegError as error:
            raise ValueError(f"{path}: not a readable video ({error.strerror})") from None
        for track in self.tracks:
            track.packets.sort(key=lambda packet: packet.pts)


def _track(path: Path, stream: Any) -> Track:
    context = stream.codec_context
    name = stream.metadata.get("title", "")
    return Track(path, stream.index, name, context.name, context.codec_tag, context.width, context.height)
