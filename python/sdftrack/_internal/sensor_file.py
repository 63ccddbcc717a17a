# SPDX-License-Identifier: MIT
"""A sensor model as a file: flat ``name = value`` lines of TOML, or one JSON object."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from sdftrack._internal.files import write_text
from sdftrack._internal.text_files import read_json, read_toml

__all__ = ["read", "write"]

HEAD = "# Depth sensor: lengths in metres, see docs/sensors.md. Use: st.Tracker(..., sensor=FILE) or --sensor FILE\n"


def write(values: dict[str, Any], path: str | os.PathLike[str]) -> None:
    """Write completely or not at all; JSON if the name ends in .json, else TOML."""
    if Path(path).suffix.lower() == ".json":
        text = json.dumps(values, indent=2) + "\n"
    else:
        text = HEAD + "".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items())
    write_text(path, text)


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read the values of a file, not validated; ValueError if it is neither TOML nor JSON."""
    if not os.path.isfile(path):
        raise FileNotFoundError(f"sensor: no such file: {os.fspath(path)}")
    try:
        values = read_json(path) if Path(path).suffix.lower() == ".json" else read_toml(path)
    except ValueError as error:
        raise ValueError(
            f"sensor: expected a file that `sdftrack calibrate depth` wrote, got: {error}"
        ) from None
    if not isinstance(values, dict):
        raise ValueError(
            f"sensor: {os.fspath(path)}: expected one object of names and values, got a {type(values).__name__}"
        )
    return values
