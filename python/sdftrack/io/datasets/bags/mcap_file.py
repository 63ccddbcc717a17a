# SPDX-License-Identifier: MIT
"""MCAP files: by the chunk index of their summary or, where it is missing, by all records as far as they are whole."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sdftrack._internal.extras import need
from sdftrack.io.datasets.bags.chunks import LastChunks, decompressed
from sdftrack.io.datasets.bags.parts import ENTRY, Channel, Entries, Part

__all__ = ["MAGIC", "McapFile", "profile"]

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, DATA_END = (
    *range(1, 9),
    0x0B,
    0x0F,
)
FOOTER_SIZE = 9 + 20 + len(MAGIC)
MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
NO_CHUNK = -1
DAMAGED = (ValueError, KeyError, IndexError, OverflowError, struct.error)


def profile(path: Path) -> str | None:
    """The profile of an MCAP file ("ros1", "ros2", ""); None if it does not begin like one."""
    try:
        with path.open("rb") as file:
            start = file.read(len(MAGIC) + 13)
            if not start.startswith(MAGIC) or len(start) < len(MAGIC) + 13 or start[len(MAGIC)] != HEADER:
                return None
            return file.read(min(64, struct.unpack_from("<I", start, len(MAGIC) + 9)[0])).decode()
    except (OSError, UnicodeDecodeError):
        return None


class _Chunk(NamedTuple):
    """Position and size of a chunk's data in the file, and what they are decompressed to (`crc` 0: not checked)."""

    start: int
    size: int
    compression: str
    content_size: int
    crc: int


class McapFile(Part):
    """An ``.mcap`` file, whatever its profile."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._records = need("mcap.records", "bags")
        self._stream = need("mcap.data_stream", "bags").ReadDataStream
        self._file = path.open("rb")
        self._size = path.stat().st_size
        self._schemas: dict[int, Any] = {}
        self._chunks: dict[int, _Chunk] = {}  # by position
        self._last = LastChunks(self._content)
        self._places: dict[int, list[Entries]] = {}
        self._loose: dict[int, list[tuple[int, int, int]]] = {}  # messages outside of chunks
        try:
            if self._file.read(len(MAGIC)) != MAGIC:
                raise ValueError(f"{path}: expected an MCAP file, got another file")
            if not self._read_summary():
                self._scan()
        except BaseException:
            self._file.close()
            raise
        for n, places in self._loose.items():
            self._places.setdefault(n, []).append(np.array(places, ENTRY))
        self.index = {n: _sorted(found) for n, found in self._places.items() if n in self.channels}

    # -- Opening

    def _read_summary(self) -> bool:
        """By the summary; False if there is none, or it does not index all messages."""
        try:
            self._file.seek(max(0, self._size - FOOTER_SIZE))
            tail = self._file.read(FOOTER_SIZE)
            if len(tail) < FOOTER_SIZE or not tail.endswith(MAGIC) or tail[0] != FOOTER:
                return False
            start = struct.unpack_from("<Q", tail, 9)[0]
            if not len(MAGIC) < start < self._size:
                return False
            chunks, total, indexed = [], None, 0
            for op, at, size in self._heads(start):
                if op == CHUNK_INDEX:
                    chunks.append(self._parse("ChunkIndex", at, size))
                elif op == STATISTICS:
                    total = self._parse("Statistics", at, size).message_count
                else:
                    self._note(op, at, size)
            for chunk in chunks:
                indexed += self._index_chunk(chunk)
            if total is None or indexed == total:
                return bool(chunks) or total == 0
        except DAMAGED:
            pass
        for found in (self.channels, self._schemas, self._chunks, self._places, self._loose):
            found.clear()
        return False

    def _index_chunk(self, chunk: Any) -> int:
        """Note a chunk by its message indexes, or by its messages if it has none; their number."""
        position = chunk.chunk_start_offset
        self._note_chunk(position)
        if not chunk.message_index_offsets:
            return self._scan_chunk(position)
        count = 0
        for at in chunk.message_index_offsets.values():
            self._file.seek(at)
            op, size = struct.unpack("<BQ", self._file.read(9))
            data = self._take(size)
            if op != MESSAGE_INDEX or len(data) < size:
                raise ValueError("a message index is missing")
            raw = np.frombuffer(data, INDEX_ENTRY, offset=6)
            found = np.empty(len(raw), ENTRY)
            found["time"], found["chunk"], found["offset"] = raw["time"], position, raw["offset"]
            self._places.setdefault(struct.unpack_from("<H", data)[0], []).append(found)
            count += len(raw)
        return count

    def _scan(self) -> None:
        """By all records from the start; the data of messages outside of chunks are not read."""
        ended = False
        try:
            for op, at, size in self._heads(len(MAGIC)):
                if op == CHUNK:
                    self._note_chunk(at - 9)
                    self._scan_chunk(at - 9)
                elif op == MESSAGE and at + size <= self._size:
                    self._file.seek(at)
                    channel, _, time, _ = MESSAGE_HEAD.unpack(self._file.read(MESSAGE_HEAD.size))
                    self._loose.setdefault(channel, []).append((time, NO_CHUNK, at - 9))
                elif op in (DATA_END, FOOTER):
                    ended = True
                    break
                elif at + size <= self._size:
                    self._note(op, at, size)
        except DAMAGED:
            pass
        if not ended:
            self.damage = "its end is missing, as after an interrupted recording or copy"

    def _scan_chunk(self, position: int) -> int:
        content = self._content(position)
        found: dict[int, list[tuple[int, int, int]]] = {}
        at = 0
        while at + 9 <= len(content):
            op, size = struct.unpack_from("<BQ", content, at)
            if at + 9 + size > len(content):
                break
            if op == MESSAGE:
                channel, _, time, _ = MESSAGE_HEAD.unpack_from(content, at + 9)
                found.setdefault(channel, []).append((time, position, at))
            else:
                self._keep(op, content[at + 9 : at + 9 + size])
            at += 9 + size
        for channel, places in found.items():
            self._places.setdefault(channel, []).append(np.array(places, ENTRY))
        return sum(map(len, found.values()))

    def _note_chunk(self, position: int) -> None:
        self._file.seek(position)
        head = self._file.read(struct.calcsize("<BQQQQII"))
        op, size, _, _, content_size, crc, letters = struct.unpack("<BQQQQII", head)
        compression = self._take(letters)
        length = struct.unpack("<Q", self._file.read(8))[0]
        start = position + 9 + 40 + letters
        if op != CHUNK or size < 40 + letters:
            raise ValueError("a chunk is missing")
        size = min(length, self._size - start)
        self._chunks[position] = _Chunk(start, size, compression.decode(), content_size, crc)

    def _note(self, op: int, at: int, size: int) -> None:
        if op in (SCHEMA, CHANNEL):
            self._file.seek(at)
            self._keep(op, self._take(size))

    def _keep(self, op: int, data: bytes) -> None:
        if op == SCHEMA:
            schema = self._record("Schema", data)
            self._schemas[schema.id] = schema
        elif op == CHANNEL:
            channel = self._record("Channel", data)
            schema = self._schemas.get(channel.schema_id)
            name = "" if schema is None else schema.name
            if channel.message_encoding == "ros1" and "/msg/" not in name:
                name = name.replace("/", "/msg/")
            self.channels[channel.id] = Channel(channel.topic, name, channel.message_encoding, schema)

    def _parse(self, kind: str, at: int, size: int) -> Any:
        self._file.seek(at)
        return self._record(kind, self._take(size))

    def _record(self, kind: str, data: bytes) -> Any:
        try:
            return getattr(self._records, kind).read(self._stream(BytesIO(data)))
        except Exception as error:  # the library has its own for an end within a record
            raise ValueError(f"a damaged record {kind} ({type(error).__name__})") from None

    def _take(self, size: int) -> bytes:
        """The next bytes, at most those that the file has: memory is not taken for what a damaged length says."""
        return self._file.read(min(size, self._size))

    def _heads(self, at: int) -> Iterator[tuple[int, int, int]]:
        """Kind, position and size of the content of each record from `at` on."""
        while at + 9 <= self._size:
            self._file.seek(at)
            op, size = struct.unpack("<BQ", self._file.read(9))
            if op == 0:
                raise ValueError("a record is damaged")
            yield op, at + 9, size
            at += 9 + size

    # -- Reading

    def read(self, chunk: int, offset: int, most: int | None = None) -> bytes:
        begin, compression = 0, ""
        if chunk != NO_CHUNK:
            begin, compression = self._chunks[chunk].start, self._chunks[chunk].compression
        if compression:
            content = self._last[chunk]
            head = content[offset : offset + 9]
        else:  # straight from the file: a chunk may be large
            self._file.seek(begin + offset)
            head = self._file.read(9)
        op, size = struct.unpack("<BQ", head) if len(head) == 9 else (0, 0)
        wanted = size if most is None else min(size, most + MESSAGE_HEAD.size)
        data = content[offset + 9 : offset + 9 + wanted] if compression else self._take(wanted)
        if op != MESSAGE or len(data) < wanted:
            raise ValueError(f"{self.path.name}: a message cannot be read (its chunk is damaged)")
        return data[MESSAGE_HEAD.size :]

    def close(self) -> None:
        self._last.clear()
        self._file.close()

    def _content(self, position: int) -> bytes:
        chunk = self._chunks[position]
        self._file.seek(chunk.start)
        content = decompressed(self._take(chunk.size), chunk.compression)
        whole = len(content) == chunk.content_size
        if whole and chunk.crc and zlib.crc32(content) != chunk.crc:
            return b""  # damaged somewhere; of a chunk that is cut, the beginning is good
        return content


def _sorted(found: list[Entries]) -> Entries:
    joined = np.concatenate(found)
    return joined[np.argsort(joined["time"], kind="stable")]
