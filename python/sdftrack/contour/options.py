# SPDX-License-Identifier: MIT
"""The options of the contour tracker by name, as the core describes them (cpp/contour/option_schema.h)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack import _core
from sdftrack._internal.option_files import read_tables
from sdftrack._internal.option_schema import Option, check_options, core_schema

__all__ = ["MEANINGS", "checked_whole", "contour_options", "options_from_file"]

_SCHEMA = core_schema("contour")
MEANINGS = {name: option.meaning for name, option in _SCHEMA.items()}


def contour_options(given: dict[str, Any]) -> dict[str, Any]:
    """Return the options as plain Python values of the core's types.

    Parameters
    ----------
    given : dict
        Options by name, see `MEANINGS`; numpy numbers are accepted as well.

    Raises
    ------
    TypeError
        An unknown name (the nearest one is suggested) or a value of the wrong type.
    ValueError
        A value out of range. Constraints on several options are checked by the core.

    >>> contour_options({"bins": np.int64(32)})
    {'bins': 32}
    """
    whole = {name: _without_point(value) for name, value in given.items() if _is_whole(name)}
    checked: dict[str, Any] = check_options({**given, **whole}, _SCHEMA, others=("memory", "burn_in"))
    return checked


def options_from_file(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read and check the table ``[contour]`` of a TOML file; {} if it is missing."""
    try:
        options = contour_options(read_tables(path)["contour"])
        _core.ContourCore(options)  # which checks the bounds
        return options
    except (TypeError, ValueError) as error:
        if str(error).startswith(f"{Path(path)}:"):
            raise
        raise type(error)(f"{os.fspath(path)}: [contour] {error}") from None


def checked_whole(value: Any, option: Option) -> int:
    """Accept a whole number, also as a float."""
    return int(option.check(_without_point(value)))


def _is_whole(name: str) -> bool:
    return name in _SCHEMA and _SCHEMA[name].kind == "int"


def _without_point(value: Any) -> Any:
    """Convert 16.0 to 16, which this tracker accepts as a whole number."""
    return int(value) if isinstance(value, float | np.floating) and float(value).is_integer() else value
