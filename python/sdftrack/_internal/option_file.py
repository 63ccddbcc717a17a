# SPDX-License-Identifier: MIT
"""The tables of an options file, as printed by ``sdftrack config`` and read by ``--config``."""

from __future__ import annotations

import os
from typing import Any

from sdftrack._internal.text_files import read_toml
from sdftrack._internal.unknown_option import did_you_mean
from sdftrack._internal.validation import shown

__all__ = ["read_tables"]

TABLES = ("tracker", "reconstruct", "contour")


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
