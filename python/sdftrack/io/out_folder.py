# SPDX-License-Identifier: MIT
"""Output folders: new or empty, unless they may be overwritten, and locked against a second run. The lock is on a
hidden file in the folder, so that the system releases it when a process ends, however it ends."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import TextIO

from sdftrack._internal.files import PART, PART_PREFIX
from sdftrack._internal.systems import try_lock


def refuse_folder(directory: Path, overwrite: bool) -> None:
    """Raise the errors of `prepare_folder` in advance, without creating or removing anything."""
    if directory.exists() and not (directory.is_dir() and not any(directory.iterdir())):
        _check_folder(directory)
        lock = _locked(directory)
        try:
            _check_contents(directory, overwrite)
        finally:
            if lock is not None:
                lock.release()


def refuse_inputs(directory: Path, names: Iterable[str], inputs: Iterable[tuple[str, Path | None]]) -> None:
    """ValueError if one of `names` in the folder is an input file: (option, path or None) each."""
    taken = {(directory / name).resolve(): name for name in names}
    for option, path in inputs:
        if path is not None and path.resolve() in taken:
            raise ValueError(
                f"{option}: expected no file that would be replaced by the results, got {path}; choose another --out"
            )


class OutFolder:
    """An output folder, created if need be, into which no other run writes until `release`. It is new or empty, unless
    `overwrite`; what a killed run left there does not count, and is removed. `stale` are the files of an earlier run,
    by its report. FileExistsError if the folder holds files and may not be overwritten, if it is a file, or if another
    run is writing into it; OSError if it cannot be created."""

    def __init__(self, directory: Path, overwrite: bool) -> None:
        _check_folder(directory)
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            told = f"out: cannot create the folder {directory}: {error.strerror}"
            raise OSError(error.errno, told) from None
        self._lock = _locked(directory)
        try:
            for part in _check_contents(directory, overwrite):
                part.unlink(missing_ok=True)
            # Files of others are in other folders, whatever a report says.
            self.stale = {name for name in earlier_files(directory, "report.json") if Path(name).name == name}
        except BaseException:
            self.release()
            raise

    def release(self) -> None:
        if self._lock is not None:
            self._lock.release()


def prepare_folder(directory: Path, overwrite: bool) -> set[str]:
    """Create the folder and hold it until the end of the command; errors and result (`stale`) as of `OutFolder`."""
    folder = OutFolder(directory, overwrite)
    folder.release()
    return folder.stale


def _check_folder(directory: Path) -> None:
    if directory.exists() and not directory.is_dir():
        raise FileExistsError(f"out: expected a folder, got the file {directory}")


def _locked(directory: Path) -> FolderLock | None:
    try:
        return lock_folder(directory)
    except FileExistsError:
        raise
    except OSError as error:
        raise cannot_write(error, directory) from None


def _check_contents(directory: Path, overwrite: bool) -> list[Path]:
    """What a killed run left, without a name yet; FileExistsError if there is anything else, unless `overwrite`."""
    names = (f".*{PART}", f"{PART_PREFIX}*", f"*/{PART_PREFIX}*")
    left = [path for name in names for path in directory.glob(name)]
    if not overwrite and set(directory.iterdir()) - set(left) - {directory / LOCK}:
        got = f"{directory} with files in it; choose another, or overwrite=True"
        raise FileExistsError(f"out: expected a new or empty folder, got {got}")
    return left


def earlier_files(directory: Path, report: str, command: str | None = None) -> set[str]:
    """Names of the files that the report of an earlier run, of this command if one is given, lists."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        settings = json.loads((directory / report).read_text(encoding="utf-8"))["settings"]
        if command is None or settings["command"] == command:
            return {str(name) for name in settings["files"]}
    return set()


def cannot_write(error: OSError, directory: Path) -> OSError:
    if error.errno == errno.ENOSPC or "no space left" in str(error).lower():
        told = f"no space left on the disk of {directory}; free some or choose another folder"
        return OSError(errno.ENOSPC, f"out: {told}")
    return OSError(error.errno or errno.EIO, f"out: cannot write into {directory}: {error.strerror or error}")


LOCK = ".sdftrack.lock"

# Folders that the command now running holds until its end.
_held: ContextVar[dict[Path, FolderLock] | None] = ContextVar("held", default=None)


class FolderLock:
    """The lock of an existing folder; FileExistsError if another run has it. Where the file system has no locks,
    nothing is locked."""

    def __init__(self, directory: Path) -> None:
        self._path = directory / LOCK
        self._file: TextIO | None = None
        while self._file is None:  # again where another run has removed the file before it was locked
            file = self._path.open("a+", encoding="utf-8", errors="replace")
            if not try_lock(file.fileno()):
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
