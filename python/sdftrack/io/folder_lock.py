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

__all__ = ["LOCK", "FolderLock", "lock_folder", "one_run"]

LOCK = ".sdftrack.lock"
ATTEMPTS = 100  # each ends because another run has just removed the file
HELD_BY_ANOTHER = (errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES)
WHO_BYTES = 200

# Folders that the command now running holds until its end.
_held: ContextVar[dict[Path, FolderLock] | None] = ContextVar("held", default=None)


class FolderLock:
    """The lock of an existing folder; FileExistsError if another run has it.

    Where the file system has no locks, nothing is locked.
    """

    def __init__(self, directory: Path) -> None:
        self._file: int | None = None
        self._path = directory / LOCK
        for _ in range(ATTEMPTS):
            file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                locked = _try_lock(file)
                if locked and self._is_there(file):
                    os.ftruncate(file, 0)
                    os.write(file, _me().encode())
                    self._file = file
                    return
                who = "" if locked else os.read(file, WHO_BYTES).decode("utf-8", "replace")
            finally:
                if self._file is None:
                    os.close(file)
            if not locked:
                break
        what, advice = who or "another process", "wait for its end, or choose another"
        if who == _me():
            what, advice = "this process", "close the recorder of it first"
        raise FileExistsError(
            f"out: expected a folder that no other run writes into, got {directory}, used by {what}; {advice}"
        )

    def _is_there(self, file: int) -> bool:
        """Whether the locked file still has its name: another run may have removed it before it was locked."""
        try:
            return os.path.samestat(os.fstat(file), os.stat(self._path))
        except FileNotFoundError:
            return False

    def __del__(self) -> None:
        self.release()

    def release(self) -> None:
        """Let others write into the folder. Calling it again does nothing."""
        if self._file is None:
            return
        file, self._file = self._file, None
        with contextlib.suppress(OSError):  # a folder that was removed meanwhile
            self._path.unlink(missing_ok=True)
        os.close(file)


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


def _try_lock(file: int) -> bool:
    try:
        import fcntl
    except ImportError:  # another system than those of Unix
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in HELD_BY_ANOTHER
    return True
