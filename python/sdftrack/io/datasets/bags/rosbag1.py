# SPDX-License-Identifier: MIT
"""ROS 1 bags (format 2.0), with their index or, where it is missing, by reading all records."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sdftrack.io.datasets.bags.chunks import LastChunks, decompressed
from sdftrack.io.datasets.bags.parts import ENTRY, Channel, Entries, Part

__all__ = ["START", "Rosbag1"]

START = b"#ROSBAG V2.0\n"
MESSAGE, BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
MAX_HEADER = 1 << 24  # bytes; a longer one is damage
Fields = dict[str, bytes]


class Rosbag1(Part):
    """A ``.bag`` file, or its first `most` bytes."""

    def __init__(self, path: Path, most: int | None = None) -> None:
        super().__init__(path)
        self._file = path.open("rb")
        self._size = path.stat().st_size if most is None else min(most, path.stat().st_size)
        self._chunks: dict[
            int, tuple[int, int, str]
        ] = {}  # position -> position of the data, size, compression
        self._last = LastChunks(self._content)
        self._places: dict[int, list[Entries]] = {}
        try:
            if self._file.read(len(START)) != START:
                raise ValueError(
                    f"{path}: expected a ROS 1 bag, which begins with #ROSBAG V2.0, got another file"
                )
            if not self._read_index():
                self._scan()
        except BaseException:
            self._file.close()
            raise
        self.index = {n: _sorted(found) for n, found in self._places.items() if n in self.channels}

    # -- Opening

    def _read_index(self) -> bool:
        """By the index at the end; False if there is none, or it is not whole."""
        try:
            header, _ = self._record(len(START))
            position = _u64(header, "index_pos")
            if not len(START) < position < self._size:
                return False
            chunks = []
            for header, data in self._records(position, self._size):
                op = header["op"][0]
                if op == CONNECTION:
                    self._connect(header, data)
                elif op == CHUNK_INFO:
                    chunks.append((_u64(header, "chunk_pos"), _u32(header, "count")))
            if len(chunks) != _u32(self._record(len(START))[0], "chunk_count"):
                raise ValueError("chunks without an index")
            for chunk, count in chunks:
                at = self._note_chunk(chunk)
                for _ in range(count):
                    header, data = self._record(at)
                    if header["op"][0] != INDEX:
                        raise ValueError("an index record is missing")
                    self._note_index(chunk, header, data)
                    at = self._file.tell()
        except (ValueError, KeyError, IndexError, struct.error):
            self._chunks.clear()
            self._places.clear()
            self.channels.clear()
            return False
        return True

    def _scan(self) -> None:
        """By all records from the start, as far as they are whole."""
        at = len(START)
        while at < self._size:
            try:
                header, start, size = self._head(at)
                if header["op"][0] == CHUNK:
                    self._chunks[at] = (start, min(size, self._size - start), header["compression"].decode())
                    self._scan_chunk(at)
                at = start + size
            except (ValueError, KeyError, IndexError, struct.error):
                break
        self.damage = "it has no index, as after an interrupted recording or copy"

    def _scan_chunk(self, position: int) -> None:
        content = self._content(position)
        found: dict[int, list[tuple[int, int, int]]] = {}
        at = 0
        try:
            while at < len(content):
                header, start = _fields(content, at)
                size = struct.unpack_from("<I", content, start)[0]
                if start + 4 + size > len(content):
                    break
                if header["op"][0] == CONNECTION:
                    self._connect(header, content[start + 4 : start + 4 + size])
                elif header["op"][0] == MESSAGE:
                    sec, nsec = struct.unpack("<II", header["time"])
                    found.setdefault(_u32(header, "conn"), []).append((sec * 10**9 + nsec, position, at))
                at = start + 4 + size
        except (ValueError, KeyError, IndexError, struct.error):
            pass  # the messages before are whole
        for connection, places in found.items():
            self._places.setdefault(connection, []).append(np.array(places, ENTRY))

    def _connect(self, header: Fields, data: bytes) -> None:
        fields, _ = _fields(struct.pack("<I", len(data)) + data, 0)
        kind = fields["type"].decode()
        if "/msg/" not in kind:
            kind = kind.replace("/", "/msg/")
        self.channels[_u32(header, "conn")] = Channel(header["topic"].decode(), kind, "ros1")

    def _note_chunk(self, position: int) -> int:
        """Note a chunk; the position after it."""
        header, start, size = self._head(position)
        if header["op"][0] != CHUNK or start + size > self._size:
            raise ValueError("a chunk is missing")
        self._chunks[position] = (start, size, header["compression"].decode())
        return start + size

    def _note_index(self, chunk: int, header: Fields, data: bytes) -> None:
        raw = np.frombuffer(data, "<u4").reshape(_u32(header, "count"), 3).astype(np.int64)
        found = np.empty(len(raw), ENTRY)
        found["time"], found["chunk"], found["offset"] = raw[:, 0] * 10**9 + raw[:, 1], chunk, raw[:, 2]
        self._places.setdefault(_u32(header, "conn"), []).append(found)

    # -- Reading

    def read(self, chunk: int, offset: int, most: int | None = None) -> bytes:
        start, _, compression = self._chunks[chunk]
        try:
            if compression == "none":  # straight from the file: a chunk may be large
                while True:
                    header, at, length = self._head(start + offset)
                    if header["op"][0] != CONNECTION:
                        break
                    offset = at + length - start
                self._file.seek(at)
                data = self._file.read(length if most is None else min(length, most))
                enough = len(data) == (length if most is None else min(length, most))
            else:
                content = self._last[chunk]
                while True:
                    header, at = _fields(content, offset)
                    length = struct.unpack_from("<I", content, at)[0]
                    if header["op"][0] != CONNECTION:
                        break
                    offset = at + 4 + length
                data = content[at + 4 : at + 4 + (length if most is None else min(length, most))]
                enough = len(content) >= at + 4 + length
            if header["op"][0] != MESSAGE or not enough:
                raise ValueError("no message there")
        except (KeyError, IndexError, struct.error, ValueError) as error:
            raise ValueError(f"{self.path.name}: a message cannot be read ({error})") from None
        return data

    def close(self) -> None:
        self._last.clear()
        self._file.close()

    def _content(self, position: int) -> bytes:
        start, size, compression = self._chunks[position]
        self._file.seek(start)
        return decompressed(self._file.read(size), compression)

    def _head(self, at: int) -> tuple[Fields, int, int]:
        """Fields of the record at `at`, position and size of its data."""
        self._file.seek(at)
        size = struct.unpack("<I", self._file.read(4))[0]
        if size > MAX_HEADER:
            raise ValueError("a record's header is damaged")
        header, _ = _fields(struct.pack("<I", size) + self._file.read(size), 0)
        return header, at + 8 + size, struct.unpack("<I", self._file.read(4))[0]

    def _record(self, at: int) -> tuple[Fields, bytes]:
        header, _, size = self._head(at)
        data = self._file.read(size)
        if len(data) < size:
            raise ValueError("a record is not whole")
        return header, data

    def _records(self, at: int, end: int) -> Iterator[tuple[Fields, bytes]]:
        while at < end:
            yield self._record(at)
            at = self._file.tell()


def _fields(data: bytes, at: int) -> tuple[Fields, int]:
    """The fields of the header at `at`, which begins with its size; and the position behind it."""
    end = at + 4 + struct.unpack_from("<I", data, at)[0]
    if end > len(data):
        raise ValueError("a record's header is not whole")
    fields, at = {}, at + 4
    while at < end:
        size = struct.unpack_from("<I", data, at)[0]
        name, equals, value = data[at + 4 : at + 4 + size].partition(b"=")
        if not equals:
            raise ValueError("a field of a record's header is damaged")
        fields[name.decode()] = value
        at += 4 + size
    return fields, end


def _u32(fields: Fields, name: str) -> int:
    return int(struct.unpack("<I", fields[name])[0])


def _u64(fields: Fields, name: str) -> int:
    return int(struct.unpack("<Q", fields[name])[0])


def _sorted(found: list[Entries]) -> Entries:
    joined = np.concatenate(found)
    return joined[np.argsort(joined["time"], kind="stable")]
