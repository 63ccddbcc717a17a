# SPDX-License-Identifier: MIT
"""Files of this package's objects: an .npz whose member header.json has all but the arrays (docs/files.md)."""

from __future__ import annotations

import contextlib
import enum
import errno
import json
import math
import os
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BufferedIOBase
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.files import replacing
from sdftrack._internal.text_files import WRONG, reason

T = TypeVar("T")

HEADER = "header.json"
MAX_HEADER_BYTES = 4_000_000  # of JSON, which takes up to 25 times as much as Python's objects
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
# {"$array": name} stands for an array in the header, {"$bytes": name} for bytes.
ARRAY, BYTES = "$array", "$bytes"


@dataclass(frozen=True)
class FileKind:
    """A kind of file: ``format`` in the header, the version that is written (earlier ones are read), and its writer."""

    name: str
    version: int
    writer: str


def write(path: str | os.PathLike[str], kind: FileKind, content: Any, *, compress: bool = False) -> None:
    """Write nested dictionaries and lists of numbers, text, bytes and arrays, completely or not at all."""
    from sdftrack import __version__

    arrays: dict[str, NDArray[Any]] = {}
    head = {"format": kind.name, "version": kind.version, "sdftrack": __version__}
    text = json.dumps({**head, "content": _packed(content, "", arrays)}).encode()
    if len(text) > MAX_HEADER_BYTES:
        raise ValueError(
            f"{os.fspath(path)}: expected less than {MAX_HEADER_BYTES} bytes of settings, got {len(text)}"
        )
    with replacing(path) as temporary:
        _write_archive(temporary, text, arrays, zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED)
        declared = len(text) + sum(array.nbytes for array in arrays.values())
        if not may_hold(temporary.stat().st_size, declared):  # too well compressed to be read again
            _write_archive(temporary, text, arrays, zipfile.ZIP_STORED)


def read(
    path: str | os.PathLike[str], kind: FileKind, make: Callable[[Any], T], plain: tuple[str, ...] = ()
) -> T:
    """What `make` makes of the content that `write` was given (with lists for tuples; arrays are writable).
    FileNotFoundError; ValueError in one line that names the file, if it is damaged, of another kind or a later version,
    or if `make` refuses its content. Nothing in a file is executed, and sizes are checked before memory is taken. A
    file without a header is read if all of `plain` that it has are arrays of it."""
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"{file}: no such file; expected one of {kind.writer}")
    with _refused(file, kind), zipfile.ZipFile(file) as archive:
        members = {info.filename: info for info in archive.infolist()}
        declared, size = sum(info.file_size for info in members.values()), file.stat().st_size
        if not may_hold(size, declared):
            raise ValueError(
                f"{declared / 1e6:.0f} MB declared by a file of {size / 1e6:.3g} MB; at most {MOST_EXPANSION} times "
                f"its size and {ALLOWANCE_BYTES / 1e6:.0f} MB more are read"
            )

        def array(name: str) -> NDArray[Any]:
            info = members.pop(
                f"{name}.npy", None
            )  # not there twice: one array for many would take all memory
            if info is None:
                raise ValueError(f"no array {name[:60]!r}, or two references to it")
            with _opened(archive, info) as opened:
                out = read_array(opened, info.file_size)
                opened.read(1)  # where the end is found, the CRC is compared
                return out

        if HEADER in members or not plain:
            content = _content(archive, members.get(HEADER), kind, array)
        else:
            content = {name: array(name) for name in plain if f"{name}.npy" in members}
    try:
        return make(content)
    except WRONG as error:
        told = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        raise ValueError(
            f"{file}: expected a file of {kind.writer}, got inconsistent contents ({told})"
        ) from error


def loaded(
    path: str | os.PathLike[str], kind: FileKind, cls: type[T], state_from: Callable[[Any], dict[str, Any]]
) -> T:
    """An object of type `cls` with the state that `state_from` makes of a file's content."""

    def make(content: Any) -> T:
        thing: Any = cls.__new__(cls)
        thing.__setstate__(state_from(content))
        return thing

    return read(path, kind, make)


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


def _packed(value: Any, place: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """JSON values; arrays and bytes go to `arrays`, named by their place (``shapes/0/values``)."""
    if isinstance(value, dict):
        return {key: _packed(each, f"{place}/{key}", arrays) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_packed(each, f"{place}/{i}", arrays) for i, each in enumerate(value)]
    name = place.removeprefix("/")
    if isinstance(value, np.ndarray):
        arrays[name] = value
        return {ARRAY: name}
    if isinstance(value, bytes):
        arrays[name] = np.frombuffer(value, np.uint8)
        return {BYTES: name}
    if isinstance(value, enum.Enum):
        return value.value
    return value.item() if isinstance(value, np.generic) else value


def _content(
    archive: zipfile.ZipFile, info: zipfile.ZipInfo | None, kind: FileKind, array: Callable[[str], NDArray[Any]],
) -> Any:  # fmt: skip
    if info is None:
        raise ValueError("one without a header")
    if info.file_size > MAX_HEADER_BYTES:
        raise ValueError(f"a header of more than {MAX_HEADER_BYTES / 1e6:.0f} MB")

    def whole(value: dict[str, Any]) -> Any:
        if value.keys() == {ARRAY}:
            return array(value[ARRAY])
        return array(value[BYTES]).tobytes() if value.keys() == {BYTES} else value

    with _opened(archive, info) as opened:
        text = opened.read()
    head = json.loads(text)
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
    return json.loads(text, object_hook=whole)["content"]


def _opened(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Any:
    if info.compress_type not in METHODS:
        raise ValueError(f"a compression other than deflate (method {info.compress_type})")
    return archive.open(info)


def _write_archive(path: Path, text: bytes, arrays: dict[str, NDArray[Any]], method: int) -> None:
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.writestr(zipfile.ZipInfo(HEADER), text)  # of no time: the same object, the same bytes
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


@contextlib.contextmanager
def _refused(file: Path, kind: FileKind) -> Iterator[None]:
    """Any error of zipfile, zlib, json and numpy in contents that are not those of `kind`, as ValueError."""
    try:
        yield
    except MemoryError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno != errno.EINVAL:  # an offset outside the file
            raise
        told = reason(error)[:200]
        if isinstance(error, zipfile.BadZipFile):
            with file.open("rb") as opened:
                is_zip = opened.read(4) == b"PK\x03\x04"
            told = f"a truncated or damaged one ({told})" if is_zip else "another kind of file"
        raise ValueError(f"{file}: expected a file of {kind.writer}, got {told}") from None


# What a file may expand to, so that a small one cannot take all memory.
MOST_EXPANSION = 10
ALLOWANCE_BYTES = 200_000_000
CHUNK_BYTES = 1 << 24
KINDS = "biuf"  # of numpy's dtypes: bool, integers, floating point


def may_hold(file_bytes: int, array_bytes: int) -> bool:
    """Whether a file of this size is read if its contents have `array_bytes`."""
    return array_bytes <= MOST_EXPANSION * file_bytes + ALLOWANCE_BYTES


def read_array(file: BinaryIO | BufferedIOBase, file_bytes: int) -> NDArray[Any]:
    """An array of numbers in numpy's format, whose file has `file_bytes`; writable and contiguous. ValueError, also
    where it declares more than the file has; whatever numpy raises for a header that is none."""
    version = np.lib.format.read_magic(file)
    headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    if version not in headers:
        raise ValueError(f"an array of numpy's format {version}")
    shape, fortran, dtype = headers[version](file)
    if dtype.kind not in KINDS:
        raise ValueError(f"an array of {dtype}, not of numbers")
    declared = math.prod(shape) * dtype.itemsize
    if file.tell() + declared != file_bytes:
        raise ValueError(f"an array of {declared} bytes in a file of {file_bytes}")
    out = np.empty(shape[::-1] if fortran else shape, dtype)
    view, at = out.reshape(-1).view(np.uint8).data, 0
    while at < len(view):
        piece = file.read(min(CHUNK_BYTES, len(view) - at))
        if not piece:
            raise EOFError("the end of the file within an array")
        view[at : at + len(piece)] = piece
        at += len(piece)
    return out.T if fortran else out
