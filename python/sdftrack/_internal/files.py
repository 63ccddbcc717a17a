# SPDX-License-Identifier: MIT
"""Output files: written completely or not at all, or without a buffer."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from io import RawIOBase
from pathlib import Path
from typing import Any, BinaryIO

PART_PREFIX = ".part-"  # of a file that has not got its name yet
PART = ".part"  # suffix of a file that is written over a longer time


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary name next to `path`; renamed to it on success, removed on failure."""
    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: the folder {path.parent} does not exist; make it first")
    # The suffix stays, since writers choose the format by it.
    temporary = _new_beside(
        path, f"{PART_PREFIX}{path.stem}", path.suffix, lambda new: new.touch(exist_ok=False)
    )
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        raise OSError(
            errno.ENOSPC, f"{path}: no space left on the disk; free some or choose another folder"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_whole(path: str | os.PathLike[str], content: bytes | Callable[[BinaryIO], object]) -> None:
    with replacing(path) as temporary:
        if callable(content):
            with temporary.open("wb") as file:
                content(file)
        else:
            temporary.write_bytes(content)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: str | os.PathLike[str], value: Any) -> None:
    write_text(path, json.dumps(value, indent=2, allow_nan=False) + "\n")


def _new_beside(path: Path, start: str, suffix: str, make: Callable[[Path], object]) -> Path:
    """A hidden name beside `path` that `make` has made. The system gives it the permissions of any new file. To ask for
    the process's mask of permissions is to set it: files that other threads make in that moment would be open to
    all."""
    while True:
        new = path.with_name(f"{start}.{secrets.token_hex(4)}{suffix}")
        with contextlib.suppress(FileExistsError):
            make(new)
            return new


@contextlib.contextmanager
def replacing_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary folder next to `path` (new or empty); renamed to it on success."""
    path = Path(path)
    if (path.is_dir() and any(path.iterdir())) or path.is_file():
        raise FileExistsError(f"{path}: expected a new or empty folder; choose another or remove it")
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = _new_beside(path, f".{path.name}", "", lambda new: new.mkdir())
    try:
        yield temporary
        try:
            if path.is_dir():
                path.rmdir()
            os.replace(temporary, path)
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            raise FileExistsError(
                f"{path}: expected a new or empty folder, which another process has filled meanwhile; choose another"
            ) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


class UnbufferedFile:
    """A file without a buffer in this process, so that a crash loses nothing that was written. What `write` was given
    is with the operating system when it returns; OSError if the disk is full."""

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
