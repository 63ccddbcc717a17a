# SPDX-License-Identifier: MIT
"""Lines that go to disk as they come, so that a long run takes no memory; the file gets its name when it is whole."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from sdftrack.io.video import PART

__all__ = ["Spool"]


class Spool:
    """A text file under a temporary name beside `path`."""

    def __init__(self, path: Path) -> None:
        self.part = path.with_name(f".{path.name}{PART}")
        self.count = 0
        self._file = self.part.open("w+", encoding="utf-8")

    def add(self, line: str) -> None:
        self._file.write(line + "\n")
        self.count += 1

    def lines(self) -> Iterator[str]:
        """The lines so far, without their ends."""
        self._file.flush()
        with self.part.open(encoding="utf-8") as file:
            for line in file:
                yield line.rstrip("\n")

    def finish(self) -> None:
        """Close the file. OSError where the disk is full, before anything has been renamed."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()

    def drop(self) -> None:
        try:
            self._file.close()
        finally:
            self.part.unlink(missing_ok=True)
