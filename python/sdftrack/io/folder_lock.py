# SPDX-License-Identifier: MIT
"""A lock on an output folder, which two runs at once would spoil for each other.

It is held on a hidden file in the folder, so that the system releases it when a process ends, however it ends; the file
itself is removed at a regular end.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import TextIO

LOCK = ".sdftrack.lock"
HELD_BY_ANOTHER = (errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES)

# Folders that the command now running holds until its end.
_held: ContextVar[dict[Path, FolderLock] | None] = ContextVar("held", default=None)


class FolderLock:
    """The lock of an existing folder; FileExistsError if another run has it.

    Where the file system has no locks, nothing is locked.
    """

    def __init__(self, directory: Path) -> None:
        self._path = directory / LOCK
        self._file: TextIO | None = None
        while self._file is None:  # again where another run has removed the file before it was locked
            file = self._path.open("a+", encoding="utf-8", errors="replace")
            if not _try_lock(file.fileno()):
                with file:
                    file.seek(0)
                    raise FileExistsError(_held_by(file.read(200), directory))
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file.fileno()), self._path.stat()):
                    file.truncate(0)
                    file.write(_me())
                    file.flush()
                    self._file = file
                    return
            file.close()

    def __del__(self) -> None:
        self.release()

    def release(self) -> None:
        """Let others write into the folder. Calling it again does nothing."""
        if self._file is None:
            return
        file, self._file = self._file, None
        with contextlib.suppress(OSError):  # a folder that was removed meanwhile
            self._path.unlink(missing_ok=True)
        file.close()


@contextlib.contextmanager
def one_run() -> Iterator[None]:
    """Folders that are locked within, by this thread, are held until the end, and may be locked again."""
    held: dict[Path, FolderLock] = {}
    token = _held.set(held)
    try:
        yield
    finally:
        _held.reset(token)
        for lock in held.values():
            lock.release()


def lock_folder(directory: Path) -> FolderLock | None:
    """Lock an existing folder; None if it is held, and will be released, by the run that this belongs to."""
    held = _held.get()
    if held is None:
        return FolderLock(directory)
    place = directory.resolve()
    if place not in held:
        held[place] = FolderLock(directory)
    return None


def _me() -> str:
    return f"process {os.getpid()} on {socket.gethostname()}"


def _held_by(who: str, directory: Path) -> str:
    what, advice = who or "another process", "wait for its end, or choose another"
    if who == _me():
        what, advice = "this process", "close the recorder of it first"
    return f"out: expected a folder that no other run writes into, got {directory}, used by {what}; {advice}"


def _try_lock(file: int) -> bool:
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except ImportError:  # another system than those of Unix
        return True
    except OSError as error:
        return error.errno not in HELD_BY_ANOTHER
    return True
