# SPDX-License-Identifier: MIT
"""Files and folders at any address that fsspec reads (s3://, gs://, http://, ...), through a cache on this machine."""

from __future__ import annotations

import contextlib
import glob
import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from sdftrack._internal.extras import need
from sdftrack._internal.text_files import natural, reason_of

ADDRESS = re.compile(r"^[a-zA-Z][a-zA-Z0-9+.-]+(?:://|::)")  # two letters and more: C:\ is a drive
PACKAGES = "pip install s3fs, gcsfs, adlfs or aiohttp, as the address needs"


def is_address(text: str) -> bool:
    """Whether it names something that is not a path of this machine."""
    return bool(ADDRESS.match(text))


def name_of(place: str) -> str:
    """The last part of a path or an address: "run_07" of "s3://bucket/day 1/run_07/"."""
    if is_address(place):
        return PurePosixPath(place.split("::")[0].split("?")[0].rstrip("/")).name
    return Path(place).resolve().name


def expanded(pattern: str, base: Path) -> list[str]:
    """What a pattern with *, ? or [] matches, sorted; paths are relative to `base` and come back whole.
    FileNotFoundError if nothing matches."""
    if is_address(pattern):
        found = _listed(pattern)
    else:
        whole = str(base / Path(pattern).expanduser())
        # Some file that lies beside the recordings starts with a dot; it is none.
        found = sorted(glob.glob(whole, recursive=True), key=natural) if glob.has_magic(pattern) else [whole]
        found = [str(Path(path)) for path in found if os.path.exists(path)]
    if not found:
        raise FileNotFoundError(f"sequences: nothing matches {pattern}")
    return found


def _listed(pattern: str) -> list[str]:
    fs, path = _opened(pattern)
    _, separator, rest = pattern.partition("::")  # of a chain, as zip://*::s3://bucket/all.zip
    with _service(f"{pattern}: cannot list it"):
        if not glob.has_magic(path):
            return [pattern] if fs.exists(path) else []
        found = sorted(fs.glob(path), key=natural)
        # http lists whole addresses.
        return [p if is_address(p) else f"{fs.unstrip_protocol(p)}{separator}{rest}" for p in found]


@contextlib.contextmanager
def _service(told: str) -> Iterator[None]:
    """What is raised inside as OSError: each service has its own errors."""
    try:
        yield
    except Exception as error:
        raise OSError(f"{told} ({reason_of(error)})") from error


@contextlib.contextmanager
def fetched(place: str, cache: Path | None = None) -> Iterator[Path]:
    """A path on this machine with the content of `place`: itself, or a copy of what lies at an address. `cache` is a
    folder that keeps the copy until the content changes; by default it is removed with the context. FileNotFoundError
    if nothing is there, OSError if it cannot be read or not all of it came, ImportError if fsspec, or what the address
    needs, is not installed."""
    if not is_address(place):
        yield Path(place)
        return
    fs, path = _opened(place)
    files: dict[str, Any] = {}
    with _service(f"{place}: cannot list it"), contextlib.suppress(FileNotFoundError):
        files = dict(sorted(fs.find(path, detail=True).items()))
    if not files:
        raise FileNotFoundError(f"{place}: nothing is there")
    if cache is not None:
        cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".sdftrack-", dir=cache, ignore_cleanup_errors=True) as folder:
        target = Path(folder) / name_of(place)
        if cache is not None:
            from fsspec.utils import tokenize

            home = cache / tokenize(place, files)
            if not home.exists():
                _copy(fs, path, place, files, target)
                # Another process may copy the same: the first one to finish wins.
                with contextlib.suppress(OSError):
                    os.rename(folder, home)
            target = home / target.name
        else:
            _copy(fs, path, place, files, target)
        yield target


def _copy(fs: Any, path: str, place: str, files: dict[str, Any], target: Path) -> None:
    root = path.rstrip("/")
    for name, info in files.items():
        below = "" if name.rstrip("/") == root else name[len(root) :].lstrip("/")
        if ".." in PurePosixPath(below).parts:
            raise ValueError(f"{place}: expected names below it, got {name}")
        to = target / below
        to.parent.mkdir(parents=True, exist_ok=True)
        with _service(f"{place}: cannot read {name}"):
            fs.get_file(name, str(to))
        size = info.get("size")
        if size is not None and to.stat().st_size != size:
            raise OSError(f"{place}: {name} came with {to.stat().st_size} of {size} bytes")


def _opened(place: str) -> tuple[Any, str]:
    fsspec = need("fsspec", "batch")
    try:
        fs, path = fsspec.core.url_to_fs(place)
    except ImportError as error:
        raise ImportError(f"{place}: {reason_of(error)}; {PACKAGES}") from error
    except Exception as error:  # each service has its own
        raise ValueError(f"{place}: expected an address that fsspec reads ({reason_of(error)})") from error
    return fs, path
