# SPDX-License-Identifier: MIT
"""Files of this package's objects: an .npz with a header of JSON and a checksum of everything (docs/files.md)."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.array_archive import ArrayArchive, may_hold, write_archive
from sdftrack._internal.files import replacing
from sdftrack._internal.saved_tree import pack, unpack
from sdftrack._internal.text_files import WRONG, reason

__all__ = [
    "HEADER",
    "FileKind",
    "array_of",
    "consistent",
    "first_bytes",
    "found",
    "is_sealed",
    "loaded",
    "read",
    "write",
]

T = TypeVar("T")

HEADER = "header.json"
MOST_HEADER_BYTES = 4_000_000  # of JSON, which takes up to 25 times as much as Python's objects
# The comment at the end of the zip file: the BLAKE2b digest, 32 bytes, of everything before its digits.
SEAL = b"sdftrack blake2b "
DIGITS = 64
CHUNK_BYTES = 1 << 20


@dataclass(frozen=True)
class FileKind:
    """A kind of file.

    Attributes
    ----------
    name : str
        ``format`` in the header.
    version : int
        Written; it and earlier ones are read.
    writer : str
        The method that writes it, for messages.
    """

    name: str
    version: int
    writer: str


def write(path: str | os.PathLike[str], kind: FileKind, content: Any, *, compress: bool = False) -> None:
    """Write nested dictionaries and lists of numbers, text, bytes and arrays, completely or not at all."""
    from sdftrack import __version__

    tree, arrays = pack(content)
    head = {"format": kind.name, "version": kind.version, "sdftrack": __version__, "content": tree}
    text = json.dumps(head, allow_nan=False).encode()
    if len(text) > MOST_HEADER_BYTES:
        raise ValueError(
            f"{os.fspath(path)}: expected less than {MOST_HEADER_BYTES} bytes of settings, got {len(text)}"
        )
    with replacing(path) as temporary:
        write_archive(temporary, (HEADER, text), arrays, compress, SEAL + b"0" * DIGITS)
        declared = len(text) + sum(array.nbytes for array in arrays.values())
        if not may_hold(temporary.stat().st_size, declared):  # too well compressed to be read again
            write_archive(temporary, (HEADER, text), arrays, False, SEAL + b"0" * DIGITS)
        with temporary.open("r+b") as file:
            digest = _digest(temporary)
            file.seek(-DIGITS, os.SEEK_END)
            file.write(digest)


def read(path: str | os.PathLike[str], kind: FileKind) -> Any:
    """Read what `write` was given, with lists for tuples.

    FileNotFoundError; ValueError in one line that names the file, if it is damaged, of another kind or a later version.
    The arrays are writable. Nothing in a file is executed, and sizes are checked before memory is taken.
    """
    file = found(path, kind)
    with _named(file, kind):
        if not is_sealed(file):
            cut = first_bytes(file, 4) == b"PK\x03\x04"
            raise ValueError("a truncated or damaged one" if cut else "another kind of file")
        if _digest(file) != _last_bytes(file, DIGITS):
            raise ValueError("a damaged one: the checksum does not match; use another copy")
        with ArrayArchive(file, file.stat().st_size) as archive:
            return unpack(_content(archive, kind), archive.array)


def loaded(
    path: str | os.PathLike[str], kind: FileKind, cls: type[T], state_from: Callable[[Any], dict[str, Any]]
) -> T:
    """An object of type `cls` with the state that `state_from` makes of a file's content."""
    content = read(path, kind)
    thing: Any = cls.__new__(cls)
    with consistent(path, kind):
        thing.__setstate__(state_from(content))
    return cast(T, thing)


def found(path: str | os.PathLike[str], kind: FileKind) -> Path:
    """The path of an existing file; FileNotFoundError."""
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"{file}: no such file; expected one of {kind.writer}")
    return file


def is_sealed(file: Path) -> bool:
    """Whether a file ends as `write` ends it, with a checksum, right or wrong."""
    return _last_bytes(file, len(SEAL) + DIGITS)[: len(SEAL)] == SEAL


@contextlib.contextmanager
def consistent(path: str | os.PathLike[str], kind: FileKind) -> Iterator[None]:
    """Errors of objects made from a file's contents, as ValueError that names the file."""
    try:
        yield
    except WRONG as error:
        text = " ".join(f"{error}".split())
        raise ValueError(
            f"{os.fspath(path)}: expected a file of {kind.writer}, got inconsistent contents "
            f"({type(error).__name__}: {text[:200]})"
        ) from error


def array_of(value: Any, name: str, dtype: Any, shape: tuple[int | None, ...]) -> NDArray[Any]:
    """`value` if it is an array of this type and shape (None: any length); ValueError."""
    if (
        not isinstance(value, np.ndarray)
        or value.dtype != dtype
        or value.ndim != len(shape)
        or any(want is not None and have != want for have, want in zip(value.shape, shape, strict=True))
    ):
        got = f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
        raise ValueError(f"{name}: expected {np.dtype(dtype)} {shape}, got {got}")
    return value


def _content(archive: ArrayArchive, kind: FileKind) -> Any:
    """The checked header's content."""
    text = archive.text(HEADER, MOST_HEADER_BYTES)
    head = None if text is None else json.loads(text)
    if not isinstance(head, dict) or "content" not in head:
        raise ValueError("one without a header")
    name, version = head.get("format"), head.get("version")
    if name != kind.name:
        raise ValueError(f"one of {str(name)[:40]!r}")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ValueError(f"one of version {str(version)[:20]!r}")
    if version > kind.version:
        raise ValueError(
            f"version {version} of sdftrack {str(head.get('sdftrack'))[:20]}, later than version {kind.version}; "
            "read it with that release"
        )
    return head["content"]


@contextlib.contextmanager
def _named(file: Path, kind: FileKind) -> Iterator[None]:
    try:
        yield
    except (ValueError, RecursionError) as error:
        told = "a header nested too deeply" if isinstance(error, RecursionError) else reason(error)
        raise ValueError(f"{file}: expected a file of {kind.writer}, got {told}") from None


def first_bytes(file: Path, count: int) -> bytes:
    """The beginning of a file, by which others than ours are recognised."""
    with file.open("rb") as opened:
        return opened.read(count)


def _last_bytes(file: Path, count: int) -> bytes:
    with file.open("rb") as opened:
        size = opened.seek(0, os.SEEK_END)
        opened.seek(max(0, size - count))
        return opened.read(count)


def _digest(file: Path) -> bytes:
    """Hexadecimal digits of the digest of a file without its last `DIGITS` bytes."""
    import hashlib

    digest = hashlib.blake2b(digest_size=DIGITS // 2)
    with file.open("rb") as opened:
        left = opened.seek(0, os.SEEK_END) - DIGITS
        opened.seek(0)
        while left > 0 and (piece := opened.read(min(left, CHUNK_BYTES))):
            digest.update(piece)
            left -= len(piece)
    return digest.hexdigest().encode()
