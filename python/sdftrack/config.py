# SPDX-License-Identifier: MIT
"""Every option as TOML, with default and meaning: printed by ``sdftrack config``, read by ``--config``."""

from __future__ import annotations

import dataclasses
import difflib
import json
import os
from typing import Any

__all__ = ["options_as_toml", "read_tables"]

TABLES = ("tracker", "reconstruct", "contour")


def options_as_toml(options: Any = None, reconstruct: Any = None, contour: Any = None) -> str:
    """Text of a TOML file that sets every option to its default, or to those that are given."""
    from sdftrack import _core
    from sdftrack.contour.options import MEANINGS
    from sdftrack.options import TrackerOptions
    from sdftrack.reconstruction.options import ReconstructorOptions

    lines = [
        "# Options of sdftrack; pass this file with --config. A line that is left out keeps its default.",
        "# Units are in the names: _m metres, _rad radians, _px pixels.",
        "",
        "[tracker]",
        *_lines(options or TrackerOptions()),
        "",
        "[reconstruct]",
        *_lines(reconstruct or ReconstructorOptions()),
        "",
        "[contour]",
        *_told({**_core.contour_options(), **(contour or {})}, MEANINGS),
    ]
    return "\n".join(lines) + "\n"


def _lines(options: Any) -> list[str]:
    lines = []
    for f in dataclasses.fields(options):
        value = getattr(options, f.name)
        lines.append(f"# {f.metadata.get('meaning', '')}".rstrip())
        # TOML has no word for None.
        lines.append(f"# {f.name} is None: left out" if value is None else f"{f.name} = {_toml(value)}")
    return lines


def _told(values: dict[str, Any], meanings: dict[str, str]) -> list[str]:
    return [
        line for name, value in values.items() for line in (f"# {meanings[name]}", f"{name} = {_toml(value)}")
    ]


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)


def read_tables(path: str | os.PathLike[str]) -> dict[str, dict[str, Any]]:
    """The tables [tracker], [reconstruct] and [contour] of a TOML file, {} for one that is not there.

    The tracker's options may also stand at the top level, without their table.
    """
    import tomllib

    if not os.path.isfile(path):
        raise FileNotFoundError(f"options: no such file: {os.fspath(path)}")
    with open(path, "rb") as file:
        try:
            values = tomllib.load(file)
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{os.fspath(path)}: not a TOML file: {error}") from None
    tables = {name: values.pop(name) for name in TABLES if name in values}
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise ValueError(f"{os.fspath(path)}: expected a table [{name}], got {name} = {table!r}")
    strange = [name for name, value in values.items() if "tracker" in tables or isinstance(value, dict)]
    if strange:
        near = difflib.get_close_matches(strange[0], TABLES, 1)
        raise ValueError(
            f"{os.fspath(path)}: expected the options in [tracker], or all of them without a table, and those of "
            f"reconstruct and contour in [reconstruct] and [contour], got {', '.join(strange)} beside it"
            + (f"; did you mean [{near[0]}]?" if near else "")
        )
    return {"tracker": values, "reconstruct": {}, "contour": {}, **tables}
