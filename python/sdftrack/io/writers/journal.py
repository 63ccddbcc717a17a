# SPDX-License-Identifier: MIT
"""The frames written so far, one JSON line each, from which an interrupted recording is continued or finished."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TextIO

NAME, RESERVE = ".frames.jsonl", ".reserve"
RESERVE_STEP = 1 << 20


class Journal:
    """A hidden file in the folder of a recording that is not finished.

    Beside it a file keeps disk space free, so that a recording that has filled the disk can still be finished: the
    index files are about as large as the journal. A continuation (`resume`) must agree with the `header`: layout,
    camera, objects; it goes on before the first entry that is not `whole`.
    """

    def __init__(
        self,
        folder: Path,
        header: dict[str, Any],
        resume: bool = False,
        whole: Callable[[dict[str, Any]], bool] = lambda _: True,
    ) -> None:
        self._path, self._reserve = folder / NAME, folder / RESERVE
        self.count, self.last = 0, None
        header = json.loads(json.dumps(header))
        if resume:
            self._continue(header, whole)
        self._file: TextIO = self._path.open("a" if resume else "w", encoding="utf-8")
        self._size = self._path.stat().st_size
        self._reserved = 0
        if not resume:
            self._line(header)
        self._keep_space()

    last: dict[str, Any] | None

    @staticmethod
    def is_in(folder: Path) -> bool:
        """Whether the folder holds an interrupted recording."""
        return (folder / NAME).is_file()

    def _continue(self, header: dict[str, Any], is_whole: Callable[[dict[str, Any]], bool]) -> None:
        with self._path.open("rb") as file:
            lines, whole = 0, 0
            for line in file:
                entry = _entry(line)
                if entry is None or (lines and not is_whole(entry)):  # cut while it was written
                    break
                if lines == 0 and entry != header:
                    changed = ", ".join(k for k in header if entry.get(k) != header[k]) or "its contents"
                    raise ValueError(
                        f"{self._path.parent}: expected the recording that was interrupted there, got another one "
                        f"(different: {changed}); choose another folder"
                    )
                self.last = entry if lines else None
                lines, whole = lines + 1, whole + len(line)
        if not lines:
            raise ValueError(f"{self._path}: the header is missing; remove the folder and start again")
        os.truncate(self._path, whole)
        self.count = lines - 1

    def add(self, entry: dict[str, Any]) -> None:
        """Append a frame; it is in the file when this returns."""
        self._line(entry)
        self.count, self.last = self.count + 1, entry
        self._keep_space()

    def entries(self) -> Iterator[dict[str, Any]]:
        with self._path.open(encoding="utf-8") as file:
            next(file)
            for line in file:
                yield json.loads(line)

    def free_reserve(self) -> None:
        """Give back the space that was kept for the index files."""
        self._reserve.unlink(missing_ok=True)

    def remove(self) -> None:
        """The recording is complete."""
        self.close()
        self.free_reserve()
        self._path.unlink(missing_ok=True)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._file.close()

    def _line(self, entry: dict[str, Any]) -> None:
        text = json.dumps(entry, allow_nan=False) + "\n"
        try:
            self._file.write(text)
            self._file.flush()
        except BaseException:  # a full disk, or Ctrl-C
            with contextlib.suppress(OSError):
                self._file.close()  # drops what could not be written
            with contextlib.suppress(OSError):
                os.truncate(self._path, self._size)
            self._file = self._path.open("a", encoding="utf-8")
            raise
        self._size += len(text.encode())

    def _keep_space(self) -> None:
        if 2 * self._size < self._reserved:
            return
        target = self._reserved + RESERVE_STEP
        with self._reserve.open("ab") as file:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, target)
            else:
                file.write(bytes(target - file.tell()))
        self._reserved = target


def _entry(line: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if line.endswith(b"\n") and isinstance(entry, dict) else None
