# SPDX-License-Identifier: MIT
"""Arrays of .npz files, read with bounds: sizes are checked before memory is taken, and nothing is unpickled."""

from __future__ import annotations

import contextlib
import errno
import math
import zipfile
from collections.abc import Iterator
from io import BufferedIOBase
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.text_files import reason_of

__all__ = ["ArrayArchive", "may_hold", "read_array", "write_archive"]

# What a file may expand to, so that a small one cannot take all memory.
MOST_EXPANSION = 10
ALLOWANCE_BYTES = 200_000_000
CHUNK_BYTES = 1 << 24
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
KINDS = "biuf"  # of numpy's dtypes: bool, integers, floating point


def may_hold(file_bytes: int, array_bytes: int) -> bool:
    """Whether a file of this size is read if its contents have `array_bytes`."""
    return array_bytes <= MOST_EXPANSION * file_bytes + ALLOWANCE_BYTES


def write_archive(
    path: Path,
    text: tuple[str, bytes] | None,
    arrays: dict[str, NDArray[Any]],
    compress: bool,
    comment: bytes,
) -> None:
    """Write arrays, and before them one file of text, to an .npz that ends with `comment`."""
    method = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.comment = comment
        if text is not None:
            archive.writestr(zipfile.ZipInfo(text[0]), text[1])
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


class ArrayArchive:
    """An .npz file, open for reading; ValueError in one line for damaged or excessive contents.

    Parameters
    ----------
    source : Path or binary file
    file_bytes : int
        Size of the file.
    """

    def __init__(self, source: Path | BinaryIO, file_bytes: int) -> None:
        with _told():
            self._zip = zipfile.ZipFile(source)
            infos = self._zip.infolist()
            declared = sum(info.file_size for info in infos)
            if not may_hold(file_bytes, declared):
                self._zip.close()
                raise ValueError(
                    f"{declared / 1e6:.0f} MB declared by a file of {file_bytes / 1e6:.3g} MB; at most "
                    f"{MOST_EXPANSION} times its size and {ALLOWANCE_BYTES / 1e6:.0f} MB more are read"
                )
            self._infos = {info.filename: info for info in infos}

    def __enter__(self) -> ArrayArchive:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._zip.close()

    def __contains__(self, name: str) -> bool:
        return f"{name}.npy" in self._infos

    @property
    def names(self) -> list[str]:
        """Names of the arrays."""
        return [name.removesuffix(".npy") for name in self._infos if name.endswith(".npy")]

    def text(self, name: str, most_bytes: int) -> bytes | None:
        """Contents of a file that is no array; None if there is none."""
        if name not in self._infos:
            return None
        with _told(), self._opened(name) as file:
            if self._infos[name].file_size > most_bytes:
                raise ValueError(f"a header of more than {most_bytes / 1e6:.0f} MB")
            return file.read()

    def array(self, name: str) -> NDArray[Any]:
        """Read an array, writable and contiguous."""
        with _told():
            if name not in self:
                raise ValueError(f"no array {name[:60]!r}")
            with self._opened(f"{name}.npy") as file:
                out = read_array(file, self._infos[f"{name}.npy"].file_size)
                file.read(1)  # where the end is found, the CRC is compared
                return out

    def _opened(self, name: str) -> zipfile.ZipExtFile:
        info = self._infos[name]
        if info.compress_type not in METHODS:
            raise ValueError(f"a compression other than deflate (method {info.compress_type})")
        file = self._zip.open(info)
        assert isinstance(file, zipfile.ZipExtFile)
        return file


def read_array(file: BinaryIO | BufferedIOBase, file_bytes: int) -> NDArray[Any]:
    """An array of numbers in numpy's format, whose file has `file_bytes`; writable and contiguous.

    ValueError, also where it declares more than the file has; whatever numpy raises for a header that is none.
    """
    shape, fortran, dtype = _npy_header(file)
    if dtype.kind not in KINDS:
        raise ValueError(f"an array of {dtype}, not of numbers")
    declared = math.prod(shape) * dtype.itemsize
    if file.tell() + declared != file_bytes:
        raise ValueError(f"an array of {declared} bytes in a file of {file_bytes}")
    out = np.empty(shape[::-1] if fortran else shape, dtype)
    view = out.reshape(-1).view(np.uint8).data
    at = 0
    while at < len(view):
        piece = file.read(min(CHUNK_BYTES, len(view) - at))
        if not piece:
            raise EOFError("the end of the file within an array")
        view[at : at + len(piece)] = piece
        at += len(piece)
    return out.T if fortran else out


def _npy_header(file: BinaryIO | BufferedIOBase) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        return np.lib.format.read_array_header_1_0(file)
    if version == (2, 0):
        return np.lib.format.read_array_header_2_0(file)
    raise ValueError(f"an array of numpy's format {version}")


@contextlib.contextmanager
def _told() -> Iterator[None]:
    """Any error of zipfile, zlib and numpy in contents that are no archive of arrays, as ValueError."""
    try:
        yield
    except MemoryError:
        raise
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
        raise ValueError("an offset outside the file") from None
    except Exception as error:
        raise ValueError(reason_of(error)[:200]) from None
