# SPDX-License-Identifier: MIT
"""Files and folders at any address that fsspec reads (s3://, gs://, http://, ...), through a cache on this machine."""

from __future__ import annotations

import contextlib
import glob
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from sdftrack._internal.extras import need
from sdftrack._internal.natural_order import natural
from sdftrack._internal.text_files import reason_of

ADDRESS = re.compile(r"^[a-zA-Z][a-zA-Z0-9+.-]+(?:://|::)")  # two letters and more: C:\ is a drive
PACKAGES = "pip install s3fs, gcsfs, adlfs or aiohttp, as the address needs"


def is_address(text: str) -> bool:
    """Whether it names something that is not a path of this machine.

    >>> is_address("s3://bucket/run"), is_address("data/run"), is_address("C:/data")
    (True, False, False)
    """
    return bool(ADDRESS.match(text))


def name_of(place: str) -> str:
    """The last part of a path or an address.

    >>> name_of("s3://bucket/day 1/run_07/")
    'run_07'
    """
    if is_address(place):
        return PurePosixPath(place.split("::")[0].split("?")[0].rstrip("/")).name
    return Path(place).resolve().name


def expanded(pattern: str, base: Path) -> list[str]:
    """What a pattern with *, ? or [] matches, sorted; paths are relative to `base` and come back whole.

    FileNotFoundError if nothing matches.
    """
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
    with _service(f"{pattern}: cannot list it"):
        if glob.has_magic(path):
            found = [_with_protocol(fs, pattern, name) for name in sorted(fs.glob(path), key=natural)]
        else:
            found = [pattern] if fs.exists(path) else []
    return found


@contextlib.contextmanager
def _service(told: str) -> Iterator[None]:
    """What is raised inside as OSError: each service has its own errors."""
    try:
        yield
    except Exception as error:
        raise OSError(f"{told} ({reason_of(error)})") from error


def _with_protocol(fs: Any, pattern: str, path: str) -> str:
    if is_address(path):  # http lists whole addresses
        return path
    _, separator, rest = pattern.partition("::")  # of a chain, as zip://*::s3://bucket/all.zip
    return f"{fs.unstrip_protocol(path)}{separator}{rest}"


@contextlib.contextmanager
def fetched(place: str, cache: Path | None = None) -> Iterator[Path]:
    """A path on this machine with the content of `place`: itself, or a copy of what lies at an address.

    `cache` is a folder that keeps the copy for later; by default it is removed with the context. FileNotFoundError if
    nothing is there, OSError if it cannot be read or not all of it came, ImportError if fsspec, or what the address
    needs, is not installed.
    """
    if not is_address(place):
        yield Path(place)
        return
    fs, path = _opened(place)
    if cache is not None:
        yield _kept(fs, path, place, cache)
        return
    with tempfile.TemporaryDirectory(prefix="sdftrack-") as folder:
        target = Path(folder) / name_of(place)
        _copy(fs, path, place, target)
        yield target


def _kept(fs: Any, path: str, place: str, cache: Path) -> Path:
    """The copy in the cache; another one if what is there has changed."""
    from fsspec.utils import tokenize

    home = cache / tokenize(place, _files(fs, path, place))
    target = home / name_of(place)
    if target.exists():
        return target
    cache.mkdir(parents=True, exist_ok=True)
    # Another process may copy the same: the first one to finish wins.
    temporary = Path(tempfile.mkdtemp(prefix=f".{home.name}.", dir=cache))
    try:
        _copy(fs, path, place, temporary / target.name)
        with contextlib.suppress(OSError):
            os.rename(temporary, home)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return target


def _copy(fs: Any, path: str, place: str, target: Path) -> None:
    root = path.rstrip("/")
    for name, info in _files(fs, path, place).items():
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


def _files(fs: Any, path: str, place: str) -> dict[str, Any]:
    """Information on each file below `path`, or on the file that it is."""
    found: dict[str, Any] = {}
    with _service(f"{place}: cannot list it"), contextlib.suppress(FileNotFoundError):
        found = dict(sorted(fs.find(path, detail=True).items()))
    if not found:
        raise FileNotFoundError(f"{place}: nothing is there")
    return found


def _opened(place: str) -> tuple[Any, str]:
    fsspec = need("fsspec", "batch")
    try:
        fs, path = fsspec.core.url_to_fs(place)
    except ImportError as error:
        raise ImportError(f"{place}: {reason_of(error)}; {PACKAGES}") from error
    except Exception as error:  # each service has its own
        raise ValueError(f"{place}: expected an address that fsspec reads ({reason_of(error)})") from error
    return fs, path
