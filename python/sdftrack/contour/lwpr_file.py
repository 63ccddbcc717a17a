# SPDX-License-Identifier: MIT
"""The file of an LWPR: a mark, a line of JSON, the core's bytes, a checksum."""

from __future__ import annotations

import json
import os
import zlib
from typing import Any

import numpy as np

from sdftrack.io.files import write_whole

__all__ = ["read", "write"]

MARK = b"sdftrack LWPR 1\n"
SUM_BYTES = 4


def write(path: str | os.PathLike[str], state: dict[str, Any]) -> None:
    """Write the state of a model whole or not at all."""
    parameters = {
        name: value.tolist() if isinstance(value, np.ndarray | np.generic) else value
        for name, value in state["parameters"].items()
    }
    head = json.dumps({"parameters": parameters, "flat": state["flat"]}).encode() + b"\n"
    content = MARK + head + state["core"]
    write_whole(path, content + zlib.crc32(content).to_bytes(SUM_BYTES, "little"))


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read it back; ValueError for anything else (the caller names the file)."""
    if not os.path.isfile(path):
        raise FileNotFoundError(f"lwpr: no such file: {os.fspath(path)}")
    with open(path, "rb") as file:
        data = file.read()
    if not data.startswith(MARK):
        raise ValueError("expected a file of LWPR.save (version 1), got something else")
    content, checksum = data[:-SUM_BYTES], data[-SUM_BYTES:]
    if zlib.crc32(content).to_bytes(SUM_BYTES, "little") != checksum:
        raise ValueError("expected a file of LWPR.save, got one that was cut off or damaged")
    head, _, core = content[len(MARK) :].partition(b"\n")
    return {**json.loads(head), "core": core}
