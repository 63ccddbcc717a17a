# SPDX-License-Identifier: MIT
"""Output folders: new or empty, unless they may be overwritten."""

from __future__ import annotations

import contextlib
import errno
import json
from collections.abc import Iterable
from pathlib import Path

from sdftrack.io.video import PART

__all__ = ["cannot_write", "prepare_folder", "refuse_folder", "refuse_inputs"]


def refuse_folder(directory: Path, overwrite: bool) -> None:
    """Raise the errors of `prepare_folder` in advance, without creating anything."""
    if directory.exists() and not (directory.is_dir() and not any(directory.iterdir())):
        prepare_folder(directory, overwrite)


def refuse_inputs(directory: Path, names: Iterable[str], inputs: Iterable[tuple[str, Path | None]]) -> None:
    """ValueError if one of `names` in the folder is an input file: (option, path or None) each."""
    taken = {(directory / name).resolve(): name for name in names}
    for option, path in inputs:
        if path is not None and path.resolve() in taken:
            raise ValueError(
                f"{option}: expected no file that would be replaced by the results, got {path}; choose another --out"
            )


def prepare_folder(directory: Path, overwrite: bool) -> set[str]:
    """Create the folder; raise an error if it contains files, unless `overwrite`. Returns files of an earlier run."""
    if directory.exists() and not directory.is_dir():
        raise FileExistsError(f"out: expected a folder, got the file {directory}")
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(error.errno, f"out: cannot create the folder {directory}: {error.strerror}") from None
    for part in directory.glob(f".*{PART}"):  # left by a run that was killed
        part.unlink(missing_ok=True)
    if not any(directory.iterdir()):
        return set()
    if not overwrite:
        raise FileExistsError(
            f"out: expected a new or empty folder, got {directory} with files in it; "
            "choose another, or overwrite=True"
        )
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        old = json.loads((directory / "report.json").read_text(encoding="utf-8"))["settings"]["files"]
        return {str(name) for name in old if Path(str(name)).name == str(name)}
    return set()


def cannot_write(error: OSError, directory: Path) -> OSError:
    """Convert a write error to one that names the folder and suggests a remedy."""
    if error.errno == errno.ENOSPC or "no space left" in str(error).lower():
        return OSError(
            errno.ENOSPC, f"out: no space left on the disk of {directory}; free some or choose another folder"
        )
    return OSError(error.errno or errno.EIO, f"out: cannot write into {directory}: {error.strerror or error}")
