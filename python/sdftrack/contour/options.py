# SPDX-License-Identifier: MIT
"""The options of the contour tracker by name. Defaults and bounds live in the core."""

from __future__ import annotations

import difflib
import os
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack import _core

__all__ = ["MEANINGS", "contour_options", "options_from_file"]

MEANINGS = {
    "warp": "similarity (4 unknowns) or affine (6): what moves the grid",
    "pool": "of a frame's colours into the histograms: linear or log (logarithmic)",
    "bins": "of the histograms per channel, 16 or 32",
    "windows": "histograms along each side of the grid; 1: one pair for the whole, as printed",
    "shrink": "pixels that a window's histograms borrow from those of the whole",
    "object_rate": "share of a frame in the object's histograms, once pooled",
    "background_rate": "the same for the background's",
    "least_posterior": "of a pixel, and of its opposite: no colour proves anything",
    "ring": "width of the background around the object, over the longer side of its box",
    "most_cells": "of the grid along the object's longer side; bounds the time of a frame",
    "softness": "cells over which inside goes over into outside",
    "band": "cells to each side of the outline that are looked at",
    "registration_steps": "trials of Gauss-Newton per frame, at most",
    "reach": "pixels that a jump between two frames may be beyond what Gauss-Newton bridges; 0: none is looked for",
    "shape_steps": "of the level set per frame",
    "dt": "of a step of the level set",
    "mu": "of the distance regulariser; mu dt <= 0.2",
    "tension": "of the outline; 0: the regulariser as printed, 1: a Laplacian",
    "least_part": "pieces smaller than this share of the largest are dropped",
    "box_rounds": "of colours and outline when starting from a box",
    "drift_cells": "the grid is moved once the shape is so far from its middle",
    "drift_log_scale": "and once it is larger or smaller than at the start by this much, as a logarithm",
}


def contour_options(given: dict[str, Any]) -> dict[str, Any]:
    """The options as plain Python values of the core's types.

    Parameters
    ----------
    given : dict
        Some of the names of `MEANINGS`; numpy's numbers are taken as well.

    Raises
    ------
    TypeError
        A name that is unknown (the nearest is told) or a value of another kind.
    ValueError
        A number that is not whole where one must be. The core checks the bounds.

    >>> contour_options({"bins": np.int64(32)})
    {'bins': 32}
    """
    defaults = _core.contour_options()
    return {name: _plain(name, value, defaults) for name, value in given.items()}


def options_from_file(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The table ``[contour]`` of a TOML file, checked; one without it gives {}."""
    from sdftrack.config import read_tables

    try:
        options = contour_options(read_tables(path)["contour"])
        _core.ContourCore(options)  # which checks the bounds
        return options
    except (TypeError, ValueError) as error:
        if str(error).startswith(f"{Path(path)}:"):
            raise
        raise type(error)(f"{os.fspath(path)}: [contour] {error}") from None


def _plain(name: str, value: Any, defaults: dict[str, Any]) -> Any:
    if name not in defaults:
        near = difflib.get_close_matches(name, defaults, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(defaults)}"
        raise TypeError(f"{name}: no such option of ContourTracker; {hint}")
    default = defaults[name]
    if isinstance(default, str):
        if not isinstance(value, str):
            raise TypeError(f"{name}: expected a word such as {default!r}, got {value!r}")
        return str(value)
    return whole(value, name) if isinstance(default, int) else real(value, name)


def real(value: Any, name: str) -> float:
    """A float; TypeError for what is no number."""
    if isinstance(value, (bool, np.bool_, str)):
        raise TypeError(f"{name}: expected a number, got {value!r}")
    try:
        return float(value)
    except OverflowError:  # an int of hundreds of digits
        raise ValueError(f"{name}: expected a number below 1e308, got one beyond it") from None
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number, got {value!r}") from None


def whole(value: Any, name: str) -> int:
    """A whole number that the core's int holds."""
    number = real(value, name)
    if not abs(number) < 2**31 or number != int(number):
        raise ValueError(f"{name}: expected a whole number below 2^31, got {value!r}")
    return int(number)
