# SPDX-License-Identifier: MIT
"""Files of a shape memory, and those of version 1: a header line, a checksum, then arrays in numpy's format."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path
from typing import Any

from sdftrack._internal import saved_file
from sdftrack._internal.array_archive import ArrayArchive

__all__ = ["KIND", "read", "write"]

KIND = saved_file.FileKind("sdftrack.ShapeMemory", 2, "ShapeMemory.save")
VERSION_1 = b"sdftrack shape memory 1\n"
DIGEST = 64  # hexadecimal digits of SHA-256


def write(path: str | os.PathLike[str], state: dict[str, Any]) -> None:
    """Write a memory's state, completely or not at all."""
    saved_file.write(path, KIND, state)


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a file written by `write`. FileNotFoundError; ValueError in one line for other files."""
    file = saved_file.found(path, KIND)
    if saved_file.first_bytes(file, len(VERSION_1)) == VERSION_1:
        return _version_1(file)
    state: dict[str, Any] = saved_file.read(file, KIND)
    return state


def _version_1(file: Path) -> dict[str, Any]:
    import hashlib

    rest = file.read_bytes()[len(VERSION_1) :]
    digest, body = rest[: DIGEST + 1], rest[DIGEST + 1 :]
    if hashlib.sha256(body).hexdigest().encode() + b"\n" != digest:
        raise ValueError(
            f"{file}: expected a file of {KIND.writer}, got a damaged or truncated one: the checksum does not match; "
            "use another copy"
        )
    with saved_file.consistent(file, KIND), ArrayArchive(io.BytesIO(body), len(body)) as archive:
        arrays = {name: archive.array(name) for name in archive.names}
        kinds = json.loads(arrays.pop("kinds").tobytes())
        return {name: _as(kinds[name], array) for name, array in arrays.items()}


def _as(kind: str, array: Any) -> Any:
    if kind == "bytes":
        return array.tobytes()
    return json.loads(array.tobytes()) if kind == "dict" else array
