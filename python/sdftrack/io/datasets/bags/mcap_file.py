# SPDX-License-Identifier: MIT
"""MCAP files: by the chunk index of their summary or, where it is missing, by all records as far as they are whole."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

from sdftrack._internal.closing import closed_on_error
from sdftrack._internal.extras import need
from sdftrack._internal.text_files import reason_of
from sdftrack.io.datasets.bags.bag import KEPT_CHUNKS, NO_CHUNK, Channel, Part, entries

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = 9  # bytes: kind and length
MESSAGE_HEAD = 22  # bytes before a message's data
CHUNK_HEAD = 40  # bytes before a chunk's data, without the name of the compression


def profile(path: Path) -> str | None:
    """The profile of an MCAP file ("ros1", "ros2", ""); None if it does not begin like one."""
    reader = need("mcap.reader", "bags")
    with path.open("rb") as file:
        try:
            return str(reader.make_reader(file).get_header().profile)
        except Exception:  # of many kinds, where it is another file
            return None


class McapFile(Part):
    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._library = need("mcap.stream_reader", "bags")
        self._file = path.open("rb")
        self._size = path.stat().st_size
        self._schemas: dict[int, Any] = {}
        self._chunk = lru_cache(KEPT_CHUNKS)(self._content)
        self._places: dict[int, list[tuple[int, int, int]]] = {}
        with closed_on_error(self._file):
            if self._file.read(len(MAGIC)) != MAGIC:
                raise ValueError(f"{path}: expected an MCAP file, got another file")
            if not self._read_summary():
                self._scan()
        self.index = {n: entries(found) for n, found in self._places.items() if n in self.channels}

    def _read_summary(self) -> bool:
        """By the summary; False if there is none, or it does not index all messages."""
        from mcap.reader import SeekingReader

        self._file.seek(0)
        try:
            summary = SeekingReader(self._file, record_size_limit=self._size).get_summary()
            if summary is None:
                return False
            for record in (*summary.schemas.values(), *summary.channels.values()):
                self._keep(record)
            for chunk in summary.chunk_indexes:
                if not chunk.message_index_offsets:
                    self._scan_chunk(chunk.chunk_start_offset)
                for at in chunk.message_index_offsets.values():
                    found = self._record(at)
                    places = self._places.setdefault(found.channel_id, [])
                    places += [(time, chunk.chunk_start_offset, offset) for time, offset in found.records]
            total = None if summary.statistics is None else summary.statistics.message_count
            if total == sum(map(len, self._places.values())) or (total is None and summary.chunk_indexes):
                return True
        except Exception:  # the library has its own for a damaged record, and others come from its content
            pass
        for found in (self.channels, self._schemas, self._places):
            found.clear()
        return False

    def _scan(self) -> None:
        self._file.seek(0)
        ended = False
        try:
            for record in self._records(skip_magic=False):
                end, kind = self._file.tell(), type(record).__name__
                if kind in ("DataEnd", "Footer"):
                    ended = True
                    break
                if kind == "Chunk":
                    size = CHUNK_HEAD + len(record.compression.encode()) + len(record.data)
                    with contextlib.suppress(Exception):  # a damaged one is left out
                        self._scan_chunk(end - size - RECORD_HEAD)
                    self._file.seek(end)
                elif kind == "Message":
                    at = end - len(record.data) - MESSAGE_HEAD - RECORD_HEAD
                    self._places.setdefault(record.channel_id, []).append((record.log_time, NO_CHUNK, at))
                else:
                    self._keep(record)
        except Exception:  # as above; what is before is whole
            pass
        if not ended:
            how = "an interrupted recording or copy (mcap recover repairs it)"
            self.damage = f"its end is missing, as after {how}"

    def _scan_chunk(self, position: int) -> None:
        from mcap import records
        from mcap.data_stream import ReadDataStream
        from mcap.opcode import Opcode

        content = self._chunk(position)
        stream = ReadDataStream(BytesIO(content))
        while stream.count < len(content):
            at, op, size = stream.count, stream.read1(), stream.read8()
            if op == Opcode.MESSAGE:
                message = records.Message.read(stream, size)
                self._places.setdefault(message.channel_id, []).append((message.log_time, position, at))
            elif op in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._keep((records.Schema if op == Opcode.SCHEMA else records.Channel).read(stream))
            else:
                stream.read(size)

    def _keep(self, record: Any) -> None:
        kind = type(record).__name__
        if kind == "Schema":
            self._schemas[record.id] = record
        elif kind == "Channel":
            schema = self._schemas.get(record.schema_id)
            name = "" if schema is None else schema.name
            if record.message_encoding == "ros1" and "/msg/" not in name:
                name = name.replace("/", "/msg/")
            self.channels[record.id] = Channel(record.topic, name, record.message_encoding, schema)

    def read(self, chunk: int, offset: int, most: int | None = None) -> bytes:
        try:
            if chunk == NO_CHUNK:
                record = self._record(offset)
            else:
                content = self._chunk(chunk)
                stream = BytesIO(content)
                stream.seek(offset)
                limit = len(content)
                reader = self._library.StreamReader(stream, skip_magic=True, record_size_limit=limit)
                record = next(reader.records)
            return bytes(record.data if most is None else record.data[:most])
        except Exception as error:  # the libraries of the compressions have their own
            raise ValueError(f"{self.path.name}: a message cannot be read ({reason_of(error)})") from None

    def close(self) -> None:
        self._chunk.cache_clear()
        self._file.close()

    def _record(self, at: int) -> Any:
        self._file.seek(at)
        return next(self._records())

    def _records(self, skip_magic: bool = True) -> Iterator[Any]:
        reader = self._library.StreamReader(
            self._file, skip_magic=skip_magic, emit_chunks=True, record_size_limit=self._size
        )
        return reader.records

    def _content(self, position: int) -> bytes:
        chunk = self._record(position)
        stream, size = self._library.get_chunk_data_stream(chunk, validate_crc=True)
        if size != chunk.uncompressed_size:
            raise ValueError("the chunk is damaged")
        return bytes(stream.read(size))
