# SPDX-License-Identifier: MIT
"""ROS 1 bags (format 2.0), by the index at their end."""

from __future__ import annotations

import os
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

from sdftrack._internal.extras import need
from sdftrack._internal.text_files import reason_of
from sdftrack.io.datasets.bags.bag import KEPT_CHUNKS, Channel, Part, entries

START = b"#ROSBAG V2.0\n"
STEP = 1 << 24  # bytes


class Rosbag1(Part):
    """A ``.bag`` file. ValueError if it has no whole index: ``rosbag reindex`` makes one."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        with path.open("rb") as file:
            if file.read(len(START)) != START:
                raise ValueError(
                    f"{path}: expected a ROS 1 bag, which begins with #ROSBAG V2.0, got another file"
                )
        need("rosbags", "bags")
        from rosbags.rosbag1 import reader

        self._library: Any = reader
        self._bag: Any = reader.Reader(path)
        self._chunk = lru_cache(KEPT_CHUNKS)(self._content)
        try:
            self._bag.open()
        except (OSError, MemoryError):
            raise
        except Exception as error:  # a damaged index may break the library's reader anywhere
            raise ValueError(
                f"{path}: the bag has no whole index, as after an interrupted recording or copy ({reason_of(error)}); "
                f"repair it: rosbag reindex {path.name}"
            ) from None
        self.channels = {c.id: Channel(c.topic, c.msgtype, "ros1") for c in self._bag.connections}
        self.index = {n: entries(found) for n, found in self._bag.indexes.items() if found}

    def read(self, chunk: int, offset: int, most: int | None = None) -> bytes:
        library, kind, found = self._library, self._library.RecordType, self._bag.chunks[chunk]
        try:
            stream, start = self._bag.bio, found.datapos  # straight from the file: a chunk may be large
            if found.decompressor is not library.decompressors["none"]:
                stream, start = BytesIO(self._chunk(chunk)), 0
            stream.seek(start + offset)
            while (op := library.Header.read(stream).get_uint8("op")) == kind.CONNECTION:
                stream.seek(library.read_uint32(stream), os.SEEK_CUR)
            size = library.read_uint32(stream)
            if op != kind.MSGDATA:
                raise ValueError("no message there")
            parts, left = [], size if most is None else min(size, most)
            while left > 0:  # in steps: memory is not taken for what a damaged length says
                parts.append(stream.read(min(left, STEP)))
                if not parts[-1]:
                    raise ValueError("the message is cut")
                left -= len(parts[-1])
            return b"".join(parts)
        except Exception as error:  # the libraries of the compressions have their own
            raise ValueError(f"{self.path.name}: a message cannot be read ({reason_of(error)})") from None

    def _content(self, chunk: int) -> bytes:
        found = self._bag.chunks[chunk]
        self._bag.bio.seek(found.datapos)
        return bytes(found.decompressor(self._library.read_bytes(self._bag.bio, found.datasize)))

    def close(self) -> None:
        self._chunk.cache_clear()
        if self._bag.bio is not None:
            self._bag.close()
