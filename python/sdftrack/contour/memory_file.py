# SPDX-License-Identifier: MIT
"""File format of a shape memory: a header line, a checksum, then arrays in numpy's format."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["VERSION", "from_bytes", "read", "to_bytes", "write"]

VERSION = 1
NAME = b"sdftrack shape memory "
DIGEST = 64  # hexadecimal digits of SHA-256


def write(path: str | os.PathLike[str], state: dict[str, Any]) -> None:
    """Write a memory's state, completely or not at all."""
    from sdftrack._internal.files import write_whole

    write_whole(path, to_bytes(state))


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a file written by `write`. FileNotFoundError; ValueError in one line for other files."""
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"{file}: no such file; expected one written by ShapeMemory.save")
    try:
        return from_bytes(file.read_bytes())
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None


def to_bytes(state: dict[str, Any]) -> bytes:
    """The contents of a file: the same bytes for the same state."""
    arrays: dict[str, Any] = {}
    for name, value in state.items():
        if isinstance(value, bytes):
            arrays[name] = np.frombuffer(value, np.uint8)
        elif isinstance(value, dict):
            arrays[name] = np.frombuffer(json.dumps(value, sort_keys=True).encode(), np.uint8)
        else:
            arrays[name] = np.asarray(value)
    kinds = {k: type(v).__name__ if isinstance(v, bytes | dict) else "array" for k, v in state.items()}
    arrays["kinds"] = np.frombuffer(json.dumps(kinds, sort_keys=True).encode(), np.uint8)
    body = io.BytesIO()
    np.savez(body, **arrays)
    return NAME + str(VERSION).encode() + b"\n" + _digest(body.getvalue()) + b"\n" + body.getvalue()


def from_bytes(content: bytes) -> dict[str, Any]:
    """Restore a state from `to_bytes`; ValueError for invalid bytes."""
    import zipfile

    first, _, rest = content.partition(b"\n")
    if not first.startswith(NAME):
        raise ValueError("expected a file written by ShapeMemory.save, got another kind of file")
    version = first[len(NAME) :].decode("ascii", "replace")
    if version != str(VERSION):
        raise ValueError(
            f"expected version {VERSION}, got {version[:20]}; read it with the release that wrote it"
        )
    digest, end, body = rest[:DIGEST], rest[DIGEST : DIGEST + 1], rest[DIGEST + 1 :]
    if _digest(body) != digest or end != b"\n":
        raise ValueError("damaged or truncated: the checksum does not match; use another copy")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        kinds = json.loads(arrays.pop("kinds").tobytes())
        return {name: _as(kinds[name], array) for name, array in arrays.items()}
    except (KeyError, OSError, zipfile.BadZipFile, json.JSONDecodeError) as error:
        raise ValueError(f"expected the arrays of a shape memory, got {error}") from None


def _digest(body: bytes) -> bytes:
    import hashlib

    return hashlib.sha256(body).hexdigest().encode()


def _as(kind: str, array: Any) -> Any:
    if kind == "bytes":
        return array.tobytes()
    return json.loads(array.tobytes()) if kind == "dict" else array
