# SPDX-License-Identifier: MIT
"""Matroska files as random access needs them: tracks, tags, attachments, and where each block lies."""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["Block", "MatroskaFile", "Track"]

MAGIC = b"\x1a\x45\xdf\xa3"
SEGMENT, CLUSTER, BLOCK_GROUP = 0x18538067, 0x1F43B675, 0xA0
TIMESTAMP_SCALE, DURATION, CLUSTER_TIME, SIMPLE_BLOCK, BLOCK = 0x2AD7B1, 0x4489, 0xE7, 0xA3, 0xA1
INFO, TRACKS, TAGS, ATTACHMENTS = 0x1549A966, 0x1654AE6B, 0x1254C367, 0x1941A469
TRACK_ENTRY, TRACK_NUMBER, TRACK_NAME, CODEC, CODEC_PRIVATE = 0xAE, 0xD7, 0x536E, 0x86, 0x63A2
VIDEO, WIDTH, HEIGHT, FOURCC, ENCODINGS = 0xE0, 0xB0, 0xBA, 0x2EB524, 0x6D80
CROP_BOTTOM, CROP_RIGHT = 0x54AA, 0x54DD
ATTACHED, FILE_NAME, FILE_DATA = 0x61A7, 0x466E, 0x465C
TAG, SIMPLE_TAG, TAG_NAME, TAG_TEXT = 0x7373, 0x67C8, 0x45A3, 0x4487
KEY = 0x80  # bits of a block's flags: an image that needs no other one;
LACING = 0x06  # several frames in one block, which video does not use


@dataclass(frozen=True)
class Block:
    """One image of a track: its time in nanoseconds, where its bytes are, and whether it needs no other one.

    `key` is known of simple blocks only.
    """

    time_ns: int
    start: int
    end: int
    key: bool = False


@dataclass
class Track:
    """A track; `fourcc` is that of raw video or of Microsoft's header, b"" otherwise; `private` is the codec's own."""

    name: str = ""
    codec: str = ""
    fourcc: bytes = b""
    private: bytes = b""
    width: int = 0
    height: int = 0
    cropped: tuple[int, int] = (0, 0)  # pixels on the right and at the bottom that are not to be shown
    encoded: bool = False
    blocks: list[Block] = field(default_factory=list)


class MatroskaFile:
    """The index of a file. Headers of blocks are read, their contents are not.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    tracks : {number: Track}
        Blocks in order of their time.
    tags : {name: text}
    attachments : {file name: bytes}
    duration_ns : int
        0 if it is not stated, as of a recording that was interrupted.

    Raises
    ------
    ValueError
        Not such a file. A file that is cut has the blocks before the cut.
    """

    def __init__(self, path: Path) -> None:
        self.tracks: dict[int, Track] = {}
        self.tags: dict[str, str] = {}
        self.attachments: dict[str, bytes] = {}
        self.duration_ns = 0
        self._scale_ns = 1_000_000
        with path.open("rb") as file:
            if file.read(4) != MAGIC:
                raise ValueError(f"{path}: not a Matroska file")
            self._data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        try:
            self._scan()
        except (IndexError, ValueError, ArithmeticError, struct.error) as error:
            self.close()
            raise ValueError(f"{path}: the file is damaged: {error}") from None
        for track in self.tracks.values():
            track.blocks.sort(key=lambda block: block.time_ns)

    def read(self, block: Block) -> bytes:
        """The bytes of an image."""
        return self._data[block.start : block.end]

    def close(self) -> None:
        self._data.close()

    def _scan(self) -> None:
        cluster = 0
        # Clusters and groups are entered without regard to their length, which live recorders leave open.
        for kind, start, end in self._elements(0, len(self._data), (SEGMENT, CLUSTER, BLOCK_GROUP)):
            if end > len(self._data):
                break  # cut here
            if kind == CLUSTER_TIME:
                cluster = self._number(start, end)
            elif kind in (SIMPLE_BLOCK, BLOCK):
                self._block(start, end, cluster, kind == SIMPLE_BLOCK)
            elif kind == INFO:
                places = {inner: (a, b) for inner, a, b in self._elements(start, end)}
                if TIMESTAMP_SCALE in places:
                    self._scale_ns = self._number(*places[TIMESTAMP_SCALE])
                if DURATION in places:
                    self.duration_ns = round(self._scale_ns * self._float(*places[DURATION]))
            elif kind == TRACKS:
                for inner, a, b in self._elements(start, end):  # others are checksums and padding
                    if inner == TRACK_ENTRY:
                        self._track(a, b)
            elif kind == ATTACHMENTS:
                for inner, a, b in self._elements(start, end):
                    if inner == ATTACHED:
                        found = {part: self._data[c:d] for part, c, d in self._elements(a, b)}
                        self.attachments[found.get(FILE_NAME, b"").decode()] = found.get(FILE_DATA, b"")
            elif kind == TAGS:
                for _, a, b in self._elements(start, end, (TAG,)):
                    found = {inner: self._data[c:d] for inner, c, d in self._elements(a, b)}
                    self.tags[found.get(TAG_NAME, b"").decode()] = (
                        found.get(TAG_TEXT, b"").decode().rstrip("\0")
                    )

    def _track(self, start: int, end: int) -> None:
        track, number, header = Track(), 0, b""
        for kind, a, b in self._elements(start, end, (VIDEO,)):
            value = self._data[a:b]
            if kind == TRACK_NUMBER:
                number = self._number(a, b)
            elif kind == TRACK_NAME:
                track.name = value.decode().rstrip("\0")
            elif kind == CODEC:
                track.codec = value.decode().rstrip("\0")
            elif kind == CODEC_PRIVATE:
                track.private, header = value, value[16:20]  # biCompression, if this is a BITMAPINFOHEADER
            elif kind == FOURCC:
                track.fourcc = value
            elif kind == WIDTH:
                track.width = self._number(a, b)
            elif kind == HEIGHT:
                track.height = self._number(a, b)
            elif kind == CROP_RIGHT:
                track.cropped = (self._number(a, b), track.cropped[1])
            elif kind == CROP_BOTTOM:
                track.cropped = (track.cropped[0], self._number(a, b))
            elif kind == ENCODINGS:
                track.encoded = True
        if track.codec == "V_MS/VFW/FOURCC":
            track.fourcc = header
        self.tracks[number] = track

    def _block(self, start: int, end: int, cluster: int, simple: bool) -> None:
        number, at = self._variable(start, keep_mark=False)
        after = int.from_bytes(self._data[at : at + 2], "big", signed=True)
        flags = self._data[at + 2]
        if flags & LACING:
            raise IndexError("a block with several frames")
        if number in self.tracks:
            time_ns = (cluster + after) * self._scale_ns
            self.tracks[number].blocks.append(Block(time_ns, at + 3, end, simple and bool(flags & KEY)))

    def _elements(
        self, start: int, end: int, entered: tuple[int, ...] = ()
    ) -> Iterator[tuple[int, int, int]]:
        """(id, start, end) of the elements in a range; of those of `entered`, their contents instead."""
        at = start
        while at < end:
            try:
                kind, at = self._variable(at, keep_mark=True)
                size, at = self._variable(at, keep_mark=False)
            except IndexError:
                return  # cut within a header
            if kind in entered:
                continue
            yield kind, at, at + size
            at += size

    def _variable(self, at: int, keep_mark: bool) -> tuple[int, int]:
        """An integer of variable length, and the place behind it."""
        first = self._data[at]
        length = 9 - first.bit_length()
        if length > 8 or at + length > len(self._data):
            raise IndexError(f"no element at byte {at}")
        value = int.from_bytes(self._data[at : at + length], "big")
        return value if keep_mark else value & ((1 << 7 * length) - 1), at + length

    def _float(self, start: int, end: int) -> float:
        return float(struct.unpack(">d" if end - start == 8 else ">f", self._data[start:end])[0])

    def _number(self, start: int, end: int) -> int:
        return int.from_bytes(self._data[start:end], "big")
