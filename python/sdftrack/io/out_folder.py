# SPDX-License-Identifier: MIT
"""Output folders: new or empty, unless they may be overwritten."""

from __future__ import annotations

import contextlib
import errno
import json
from collections.abc import Iterable
from pathlib import Path

from sdftrack._internal.files import PART_PREFIX
from sdftrack.io.folder_lock import LOCK, FolderLock, lock_folder
from sdftrack.io.video import PART


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
    """An output folder, created if need be, into which no other run writes until `release`.

    It is new or empty, unless `overwrite`; what a killed run left there does not count, and is removed. `stale` are the
    files of an earlier run, by its report. FileExistsError if the folder holds files and may not be overwritten, if it
    is a file, or if another run is writing into it; OSError if it cannot be created.
    """

    def __init__(self, directory: Path, overwrite: bool) -> None:
        _check_folder(directory)
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OSError(
                error.errno, f"out: cannot create the folder {directory}: {error.strerror}"
            ) from None
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
        """Let others write into the folder; within a command, that is done at its end."""
        if self._lock is not None:
            self._lock.release()


def prepare_folder(directory: Path, overwrite: bool) -> set[str]:
    """Create the folder and hold it until the end of the command; errors and result (`stale`) as of `OutFolder`."""
    folder = OutFolder(directory, overwrite)
    folder.release()
    return folder.stale


def leftovers(directory: Path) -> list[Path]:
    """Files that have not got their names yet: of a run that was killed, if none is writing."""
    return [
        path
        for name in (f".*{PART}", f"{PART_PREFIX}*", f"*/{PART_PREFIX}*")
        for path in directory.glob(name)
    ]


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
    """What a killed run left; FileExistsError if there is anything else, unless `overwrite`."""
    left = leftovers(directory)
    if not overwrite and set(directory.iterdir()) - set(left) - {directory / LOCK}:
        raise FileExistsError(
            f"out: expected a new or empty folder, got {directory} with files in it; "
            "choose another, or overwrite=True"
        )
    return left


def earlier_files(directory: Path, report: str, command: str | None = None) -> set[str]:
    """Names of the files that the report of an earlier run, of this command if one is given, lists."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        settings = json.loads((directory / report).read_text(encoding="utf-8"))["settings"]
        if command is None or settings["command"] == command:
            return {str(name) for name in settings["files"]}
    return set()


def cannot_write(error: OSError, directory: Path) -> OSError:
    """Convert a write error to one that names the folder and suggests a remedy."""
    if error.errno == errno.ENOSPC or "no space left" in str(error).lower():
        return OSError(
            errno.ENOSPC, f"out: no space left on the disk of {directory}; free some or choose another folder"
        )
    return OSError(error.errno or errno.EIO, f"out: cannot write into {directory}: {error.strerror or error}")
