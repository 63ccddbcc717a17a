# SPDX-License-Identifier: MIT
"""Every option as TOML, with default and meaning: printed by ``sdftrack config``, read by ``--config``."""

from __future__ import annotations

import json
from typing import Any

__all__ = ["options_as_toml"]


def options_as_toml(options: Any = None, reconstruct: Any = None, contour: Any = None) -> str:
    """Text of a TOML file with every option, set to the given value or its default."""
    lines = [
        "# Options of sdftrack; pass this file with --config. Omitted options keep their defaults.",
        "# Units are in the names (_m metres, _rad radians, _px pixels) or in brackets.",
    ]
    given = {
        "tracker": options.to_dict() if options else {},
        "reconstruct": vars(reconstruct) if reconstruct else {},
        "contour": contour or {},
    }
    for table, values in given.items():
        lines += ["", f"[{table}]", *_lines(table, values)]
    return "\n".join(lines) + "\n"


def _lines(table: str, given: dict[str, Any]) -> list[str]:
    from sdftrack._internal.option_declarations import schema_of

    lines = []
    for name, option in schema_of(table).items():
        value = given.get(name, option.default)
        lines.append(f"# {option.meaning}" + (f" [{option.unit}]" if option.unit else ""))
        # TOML has no word for None.
        lines.append(f"# {name} is None: omitted" if value is None else f"{name} = {_toml(value)}")
    return lines


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)
