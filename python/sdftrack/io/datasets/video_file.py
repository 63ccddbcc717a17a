# SPDX-License-Identifier: MIT
"""Files of video as random access needs them: tracks, tags, attachments, and the packets of a track in any order."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from sdftrack._internal.extras import need


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
        """Packet `n` as PyAV's; ValueError if it is not there or damaged."""
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
    """The contents of a file, which is read once: tracks of images, tags and attachments by name.

    `duration_ns` is 0 if it is not stated, as of a recording that was interrupted. ValueError for another file;
    one that is cut has the packets before the cut.
    """

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
                            by_number[packet.stream.index].packets.append(_packet(packet))
        except av.FFmpegError as error:
            raise ValueError(f"{path}: not a readable video ({error.strerror})") from None
        for track in self.tracks:
            track.packets.sort(key=lambda packet: packet.pts)


def _track(path: Path, stream: Any) -> Track:
    context = stream.codec_context
    name = stream.metadata.get("title", "")
    return Track(path, stream.index, name, context.name, context.codec_tag, context.width, context.height)


def _packet(packet: Any) -> Packet:
    time_ns = round(packet.pts * packet.time_base * 10**9)
    return Packet(packet.pts, time_ns, packet.pos, packet.size, packet.is_keyframe)
