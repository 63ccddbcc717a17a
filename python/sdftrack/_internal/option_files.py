# SPDX-License-Identifier: MIT
"""Files of options in TOML, printed by ``sdftrack config`` and read by ``--config``."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, TypeVar

from sdftrack import _core
from sdftrack._internal.text_files import read_toml
from sdftrack._internal.unknown_option import did_you_mean
from sdftrack._internal.validation import shown

O = TypeVar("O")
TABLES: dict[str, Any] = {
    "tracker": _core.TrackerOptions, "reconstruct": _core.ReconstructionOptions, "contour": _core.ContourOptions,
}  # fmt: skip


def read_tables(path: str | os.PathLike[str]) -> dict[str, dict[str, Any]]:
    """The tables [tracker], [reconstruct] and [contour] of a TOML file, {} for a missing one.

    The tracker's options may also be at the top level, without their table.
    """
    if not os.path.isfile(path):
        raise FileNotFoundError(f"options: no such file: {os.fspath(path)}")
    values = read_toml(path)
    tables = {name: values.pop(name) for name in TABLES if name in values}
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise ValueError(f"{os.fspath(path)}: expected a table [{name}], got {name} = {shown(table)}")
    strange = [name for name, value in values.items() if "tracker" in tables or isinstance(value, dict)]
    if strange:
        near = did_you_mean(strange[0], TABLES)
        raise ValueError(
            f"{os.fspath(path)}: expected the options in [tracker], or all of them without a table, and those of "
            f"reconstruct and contour in [reconstruct] and [contour], got {', '.join(strange)} beside it"
            + (f"; did you mean [{near}]?" if near else "")
        )
    return {"tracker": values, "reconstruct": {}, "contour": {}, **tables}


def options_from_file(cls: Callable[..., O], path: str | os.PathLike[str], table: str) -> O:
    """The options in a table of a file; TypeError or ValueError names the file and what is wrong."""
    values = read_tables(path)[table]
    try:
        return cls(**values)
    except (TypeError, ValueError) as error:
        where = "" if table == "tracker" else f"[{table}] "
        raise type(error)(f"{os.fspath(path)}: {where}{error}") from None


def options_as_toml(options: Any = None, reconstruct: Any = None, contour: Any = None) -> str:
    """Text of a TOML file with every option, set to the given value or its default."""
    lines = [
        "# Options of sdftrack; pass this file with --config. Omitted options keep their defaults.",
        "# Units are in the names (_m metres, _rad radians, _px pixels) or in brackets.",
    ]
    given = {
        "tracker": options.to_dict() if options else {},
        "reconstruct": reconstruct.to_dict() if reconstruct else {},
        "contour": contour or {},
    }
    for table, values in given.items():
        lines += ["", f"[{table}]", *_lines(table, values)]
    return "\n".join(lines) + "\n"


def _lines(table: str, given: dict[str, Any]) -> list[str]:
    lines = []
    for option in TABLES[table].fields().values():
        value = given.get(option.name, option.default)
        meaning, unit = option.metadata["meaning"], option.metadata["unit"]
        lines.append(f"# {meaning}" + (f" [{unit}]" if unit else ""))
        # TOML has no word for None.
        lines.append(
            f"# {option.name} is None: omitted" if value is None else f"{option.name} = {_toml(value)}"
        )
    return lines


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)
