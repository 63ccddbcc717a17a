# SPDX-License-Identifier: MIT
"""ROS 2 bags in SQLite: one ``.db3`` file."""

from __future__ import annotations

import contextlib
import sqlite3
from pathlib import Path
from urllib.parse import quote

import numpy as np

from sdftrack._internal.closing import closed_on_error
from sdftrack._internal.extras import need
from sdftrack.io.datasets.bags.bag import ENTRY, Channel, Part

START = b"SQLite format 3\0"


class SqliteFile(Part):
    """A ``.db3`` file; `compression` is that of each message, "" for none."""

    def __init__(self, path: Path, compression: str = "") -> None:
        super().__init__(path)
        self._compression = compression
        if compression not in ("", "zstd"):
            raise ValueError(
                f"{path}: expected messages compressed by zstd or not at all, got {compression!r}; "
                "convert the recording with its own tools"
            )
        with path.open("rb") as file:
            if file.read(len(START)) != START:
                raise ValueError(f"{path}: expected an SQLite database, got another file")
        self._base = _connect(path)
        with closed_on_error(self._base):
            try:
                self._read_index()
            except sqlite3.Error as error:
                told = f"{path}: expected a ROS 2 bag, got a database that cannot be read ({error})"
                raise ValueError(told) from None

    def _read_index(self) -> None:
        rows: list[tuple[int, int, int]] = []
        try:
            for number, name, kind, encoding in self._base.execute(
                "SELECT id, name, type, serialization_format FROM topics"
            ):
                self.channels[number] = Channel(name, kind, encoding)
            # In the order of the table, because another index may lie in the part that is missing.
            for row in self._base.execute("SELECT topic_id, timestamp, id FROM messages NOT INDEXED"):
                if None in row:  # as a table without its end may show
                    raise sqlite3.DatabaseError("a row is damaged")
                rows.append(row)
        except sqlite3.OperationalError:
            raise  # no such table
        except sqlite3.DatabaseError:
            self.damage = "it is damaged, as after an interrupted recording or copy"
        if self.damage:
            while rows and not self._whole(rows[-1][2]):
                rows.pop()
        table = np.array(rows, np.int64).reshape(-1, 3)
        for number in self.channels:
            own = table[table[:, 0] == number]
            found = np.empty(len(own), ENTRY)
            found["time"], found["chunk"], found["offset"] = own[:, 1], -1, own[:, 2]
            self.index[number] = found[np.argsort(found["time"], kind="stable")]

    def _whole(self, row: int) -> bool:
        try:
            self._base.execute("SELECT data FROM messages WHERE id = ?", (row,)).fetchone()
        except sqlite3.Error:
            return False
        return True

    def read(self, chunk: int, offset: int, most: int | None = None) -> bytes:
        try:
            if most is not None and not self._compression:
                with self._base.blobopen("messages", "data", offset, readonly=True) as blob:
                    return blob.read(most)  # the pages behind are not read
            row = self._base.execute("SELECT data FROM messages WHERE id = ?", (offset,)).fetchone()
        except sqlite3.Error as error:
            raise ValueError(f"{self.path.name}: message {offset} cannot be read ({error})") from None
        if row is None or not isinstance(row[0], bytes):
            raise ValueError(f"{self.path.name}: message {offset} is missing")
        if not self._compression:
            return row[0]
        zstd = need("zstandard", "bags")
        try:
            return bytes(zstd.ZstdDecompressor().decompressobj().decompress(row[0]))
        except zstd.ZstdError as error:
            raise ValueError(f"{self.path.name}: a message cannot be read ({error})") from None

    def close(self) -> None:
        self._base.close()


def topic_names(path: Path) -> list[str]:
    """The topics of a ``.db3`` file, of one that is cut as many as are whole; [] for another file."""
    with path.open("rb") as file:
        if file.read(len(START)) != START:
            return []
    base, names = _connect(path), []
    try:
        for (name,) in base.execute("SELECT name FROM topics"):
            names.append(str(name))
    except sqlite3.Error:
        pass
    finally:
        base.close()
    return names


def _connect(path: Path) -> sqlite3.Connection:
    address = f"file:{quote(str(path.resolve()))}?mode=ro"
    if not path.with_name(path.name + "-wal").exists():
        address += "&immutable=1"
    base = sqlite3.connect(address, uri=True, check_same_thread=False)
    with contextlib.suppress(sqlite3.Error):  # which the first query tells
        base.execute("PRAGMA writable_schema = ON")  # so that a cut file can be read; nothing is written
    return base
