# SPDX-License-Identifier: MIT
"""A file without a buffer in this process, so that a crash loses nothing that was written."""

from __future__ import annotations

from io import RawIOBase
from pathlib import Path

__all__ = ["UnbufferedFile"]


class UnbufferedFile:
    """What `write` was given is with the operating system when it returns; OSError if the disk is full."""

    def __init__(self, path: Path) -> None:
        self._file = open(path, "wb", buffering=0)  # noqa: SIM115  # closed by its owner
        self.tell, self.truncate, self.close = self._file.tell, self._file.truncate, self._file.close
        self.seek = self._file.seek

    def write(self, data: bytes) -> int:
        write_all(self._file, data)
        return len(data)

    def flush(self) -> None:
        pass


def write_all(file: RawIOBase, data: bytes) -> None:
    left = memoryview(data)
    while left:
        left = left[file.write(left) or 0 :]
