# SPDX-License-Identifier: MIT
"""Every option as TOML, with default and meaning: printed by ``sdftrack config``, read by ``--config``."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

__all__ = ["options_as_toml"]


def options_as_toml(options: Any = None) -> str:
    """Text of a TOML file that sets every option of the tracker to its default (or to those of `options`)."""
    from sdftrack.options import TrackerOptions

    options = TrackerOptions() if options is None else options
    lines = [
        "# Options of sdftrack; pass this file with --config. A line that is left out keeps its default.",
        "# Units are in the names: _m metres, _rad radians, _px pixels.",
        "",
        "[tracker]",
    ]
    for f in dataclasses.fields(options):
        lines.append(f"# {f.metadata.get('meaning', '')}".rstrip())
        lines.append(f"{f.name} = {_toml(getattr(options, f.name))}")
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)
