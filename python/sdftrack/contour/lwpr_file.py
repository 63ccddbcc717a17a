# SPDX-License-Identifier: MIT
"""File format of an LWPR: a magic number, a line of JSON, the core's bytes, a checksum."""

from __future__ import annotations

import json
import os
import zlib
from typing import Any

import numpy as np

from sdftrack._internal.files import write_whole

__all__ = ["plain", "read", "write"]

NAME, VERSION = b"sdftrack LWPR ", 1
MARK = NAME + str(VERSION).encode() + b"\n"
SUM_BYTES = 4


def write(path: str | os.PathLike[str], state: dict[str, Any]) -> None:
    """Write the state of a model, completely or not at all."""
    parameters = plain(state["parameters"])
    head = json.dumps({"parameters": parameters, "flat": state["flat"]}).encode() + b"\n"
    content = MARK + head + state["core"]
    write_whole(path, content + zlib.crc32(content).to_bytes(SUM_BYTES, "little"))


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read the state of a model; ValueError for other files (the caller names the file)."""
    if not os.path.isfile(path):
        raise FileNotFoundError(f"lwpr: no such file: {os.fspath(path)}")
    with open(path, "rb") as file:
        data = file.read()
    if not data.startswith(MARK):
        raise ValueError(_something_else(data))
    content, checksum = data[:-SUM_BYTES], data[-SUM_BYTES:]
    if zlib.crc32(content).to_bytes(SUM_BYTES, "little") != checksum:
        raise ValueError("expected a file of LWPR.save, got a truncated or damaged one")
    head, _, core = content[len(MARK) :].partition(b"\n")
    return {**json.loads(head), "core": core}


def plain(value: Any) -> Any:
    """Convert numpy numbers and arrays, also inside lists and dictionaries, to plain Python types for JSON."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, dict):
        return {name: plain(v) for name, v in value.items()}
    return value


def _something_else(data: bytes) -> str:
    version, ended, _ = data[len(NAME) :].partition(b"\n")
    told = version[:20].decode("ascii", "replace")
    if data.startswith(NAME) and ended and told.isdigit():
        return f"expected version {VERSION} of LWPR.save's file, got {told}; read it with the release that wrote it"
    return f"expected a file of LWPR.save (version {VERSION}), got something else"
