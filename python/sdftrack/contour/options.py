# SPDX-License-Identifier: MIT
"""The options of the contour tracker by name, as the core describes them (cpp/contour/option_schema.h)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack import _core
from sdftrack._internal.option_file import read_tables
from sdftrack._internal.option_schema import Option, check_options, core_schema

__all__ = ["MEANINGS", "checked_whole", "contour_options", "options_from_file"]

_SCHEMA = core_schema("contour")
MEANINGS = {name: option.meaning for name, option in _SCHEMA.items()}


def contour_options(given: dict[str, Any]) -> dict[str, Any]:
    """The options as plain Python values of the core's types.

    Parameters
    ----------
    given : dict
        Some of the names of `MEANINGS`; numpy's numbers are taken as well.

    Raises
    ------
    TypeError
        A name that is unknown (the nearest is named) or a value of another kind.
    ValueError
        A value out of range. The core checks what concerns several options.

    >>> contour_options({"bins": np.int64(32)})
    {'bins': 32}
    """
    whole = {name: _without_point(value) for name, value in given.items() if _is_whole(name)}
    checked: dict[str, Any] = check_options({**given, **whole}, _SCHEMA, others=("memory", "burn_in"))
    return checked


def options_from_file(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The table ``[contour]`` of a TOML file, checked; one without it gives {}."""
    try:
        options = contour_options(read_tables(path)["contour"])
        _core.ContourCore(options)  # which checks the bounds
        return options
    except (TypeError, ValueError) as error:
        if str(error).startswith(f"{Path(path)}:"):
            raise
        raise type(error)(f"{os.fspath(path)}: [contour] {error}") from None


def checked_whole(value: Any, option: Option) -> int:
    """A whole number, also as a float."""
    return int(option.check(_without_point(value)))


def _is_whole(name: str) -> bool:
    return name in _SCHEMA and _SCHEMA[name].kind == "int"


def _without_point(value: Any) -> Any:
    """16 for 16.0, which this tracker takes for a whole number too."""
    return int(value) if isinstance(value, float | np.floating) and float(value).is_integer() else value
