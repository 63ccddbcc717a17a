# SPDX-License-Identifier: MIT
"""Arguments of the wrong kind, refused by name before they fail somewhere inside."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["number", "numbers", "of_kind", "whole_number"]


def number(value: Any, name: str) -> float:
    """`value` as a float; TypeError that names the argument."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number, got {value!r}") from None


def numbers(values: Any, name: str) -> NDArray[np.float64]:
    """`values` as a float64 array in C order; TypeError that names the argument."""
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "biuf":
            raise TypeError
        return np.ascontiguousarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        text = repr(values)
        shown = text if len(text) < 60 else type(values).__name__
        raise TypeError(f"{name}: expected an array of numbers, got {shown}") from None


def whole_number(value: Any, name: str, least: int = 0, meaning: str = "") -> int:
    """`value`, numpy's whole numbers too, as an int of at least `least`; an error that names the argument."""
    wanted = f"a whole number from {least}" + (f" ({meaning})" if meaning else "")
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}: expected {wanted}, got {value!r}")
    try:
        n = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected {wanted}, got {value!r}") from None
    if not least <= n < 2**31:
        raise ValueError(f"{name}: expected {wanted} to 2^31 - 1, got {n}")
    return n


def of_kind(value: Any, kind: type, name: str, hint: str = "") -> None:
    """TypeError that names the argument unless `value` is of `kind`."""
    if not isinstance(value, kind):
        raise TypeError(
            f"{name}: expected st.{kind.__name__}, got {type(value).__name__}{hint and '; ' + hint}"
        )
