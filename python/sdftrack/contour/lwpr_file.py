# SPDX-License-Identifier: MIT
"""Files of an LWPR, and those of version 1: a magic number, a line of JSON, the core's bytes, a checksum."""

from __future__ import annotations

import json
import os
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack._internal import saved_file

__all__ = ["KIND", "plain", "read", "write"]

KIND = saved_file.FileKind("sdftrack.LWPR", 2, "LWPR.save")
VERSION_1 = b"sdftrack LWPR 1\n"
SUM_BYTES = 4


def write(path: str | os.PathLike[str], state: dict[str, Any]) -> None:
    """Write the state of a model, completely or not at all."""
    parameters = {name: _compact(value) for name, value in plain(state["parameters"]).items()}
    saved_file.write(path, KIND, {**state, "parameters": parameters})


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read the state of a model. FileNotFoundError; ValueError in one line for other files."""
    file = saved_file.found(path, KIND)
    if saved_file.first_bytes(file, len(VERSION_1)) == VERSION_1:
        return _version_1(file)
    state: dict[str, Any] = saved_file.read(file, KIND)
    with saved_file.consistent(file, KIND):
        return {**state, "parameters": plain(state["parameters"])}


def plain(value: Any) -> Any:
    """Convert numpy numbers and arrays, also inside lists and dictionaries, to plain Python types for JSON."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, dict):
        return {name: plain(v) for name, v in value.items()}
    return value


def _compact(value: Any) -> Any:
    """Lists of numbers, which may be a whole metric, as arrays."""
    return np.array(value) if isinstance(value, list) else value


def _version_1(file: Path) -> dict[str, Any]:
    data = file.read_bytes()
    content, checksum = data[:-SUM_BYTES], data[-SUM_BYTES:]
    if zlib.crc32(content).to_bytes(SUM_BYTES, "little") != checksum:
        raise ValueError(f"{file}: expected a file of {KIND.writer}, got a truncated or damaged one")
    with saved_file.consistent(file, KIND):
        head, _, core = content[len(VERSION_1) :].partition(b"\n")
        return {**json.loads(head), "core": core}
