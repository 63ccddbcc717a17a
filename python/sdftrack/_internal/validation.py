# SPDX-License-Identifier: MIT
"""Validation of argument types, with errors that name the argument."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

LONGEST_SHOWN = 80  # characters of a value in a message


def number(value: Any, name: str) -> float:
    """`value` as a float; TypeError naming the argument."""
    try:
        if isinstance(value, (str, bytes, bool, np.bool_)):
            raise TypeError
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf if value > 0 else -math.inf
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number, got {shown(value)}") from None


def within(value: Any, name: str, least: float, most: float, unit: str = "") -> float:
    """`value` as a float in least..most; errors name the argument."""
    x = number(value, name)
    if not least <= x <= most:
        raise ValueError(f"{name}: expected {least:g} to {most:g}{unit and ' ' + unit}, got {value!r}")
    return x


def positive(value: Any, name: str) -> float:
    """`value` as a float above 0 and finite; errors name the argument."""
    x = number(value, name)
    if not 0 < x < math.inf:
        raise ValueError(f"{name}: expected a positive number, got {shown(value)}")
    return x


def shown(value: Any) -> str:
    """A value as messages tell it, in part of one line.

    >>> shown(np.zeros((2, 3)))
    'an array of shape (2, 3)'
    """
    if isinstance(value, np.ndarray) and value.size > 4:
        return f"an array of shape {value.shape}"
    text = str(value) if isinstance(value, np.floating | np.integer) else repr(value)
    text = " ".join(repr(value.tolist()).split() if isinstance(value, np.ndarray) else text.split())
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 3] + "..."


def detached(value: Any) -> Any:
    """`value`, or of a tensor with a gradient the numbers alone, which numpy refuses to take otherwise."""
    return value.detach() if getattr(value, "requires_grad", False) and hasattr(value, "detach") else value


def numbers(values: Any, name: str) -> NDArray[np.float64]:
    """`values` as a float64 array in C order; TypeError naming the argument."""
    try:
        given = np.asarray(detached(values))
        if given.dtype.kind not in "biuf":
            raise TypeError
        return np.ascontiguousarray(given, dtype=np.float64)
    except (TypeError, ValueError, RuntimeError):  # torch raises the last, of tensors in a list
        text = repr(values)
        shown = text if len(text) < 60 else type(values).__name__
        raise TypeError(f"{name}: expected an array of numbers, got {shown}{_kind(values)}") from None


KINDS = {"U": "text", "S": "text", "O": "objects", "c": "complex numbers", "M": "dates", "m": "durations"}


def _kind(values: Any) -> str:
    """What the elements of an array are, in words, and how to convert them."""
    kind = getattr(getattr(values, "dtype", None), "kind", "")
    if kind not in KINDS:
        return ""
    convert = "its .real" if kind == "c" else ".astype(float), if they are numbers"
    return f" of {KINDS[kind]} (dtype {values.dtype}); convert it with {convert}"


def vector(value: Any, name: str) -> NDArray[np.float64]:
    v = numbers(value, name)
    if v.shape != (3,) or not np.isfinite(v).all():
        raise ValueError(f"{name}: expected three finite numbers (x, y, z), got {shown(value)}")
    return v


def direction(value: Any, name: str) -> NDArray[np.float64]:
    v = numbers(value, name)
    length = float(np.linalg.norm(v))
    if v.shape != (3,) or not (math.isfinite(length) and length > 0):
        raise ValueError(f"{name}: expected a direction (x, y, z), got {shown(v)}")
    return v / length


INT_MAX = 2**31 - 1  # of the core's int
THREADS = "a whole number from 0 (0: all cores)"


def whole(value: Any, name: str, least: int, most: int = INT_MAX, what: str = "") -> int:
    """`value`, an integer but not a bool, as an int in least..most; errors say that `what` was expected.

    >>> whole(np.int64(2), "threads", 0, 99, "a number of threads")
    2
    """
    wanted = what or f"a whole number from {least}" + ("" if most == INT_MAX else f" to {most}")
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        out = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected {wanted}, got {shown(value)}") from None
    if not least <= out <= most:
        raise ValueError(f"{name}: expected {wanted}, got {shown(value)}")
    return out


def one_of(value: Any, words: Iterable[str], name: str) -> str:
    """`value`, which is one of these words; TypeError or ValueError naming the argument."""
    known = list(words)
    if not isinstance(value, str) or value not in known:
        kind = ValueError if isinstance(value, str) else TypeError
        raise kind(f"{name}: expected one of {', '.join(map(repr, known))}, got {shown(value)}")
    return value


def mask_of(mask: Any, shape: tuple[int, ...] | None, name: str = "mask") -> NDArray[np.bool_]:
    """A mask (H, W) of bool or uint8, nonzero inside, as bool, of this shape, if any; errors name the argument."""
    given = np.asarray(detached(mask))
    if given.dtype not in (np.bool_, np.uint8):
        raise TypeError(f"{name}: expected bool or uint8, got {given.dtype}; compare first, as in mask > 0")
    if shape is not None and given.shape != shape:
        raise ValueError(f"{name}: expected shape {shape} as the image, got {given.shape}")
    return np.ascontiguousarray(given != 0)


def of_kind(value: Any, kind: type, name: str, hint: str = "") -> None:
    """TypeError naming the argument unless `value` is of type `kind`."""
    if not isinstance(value, kind):
        raise TypeError(
            f"{name}: expected st.{kind.__name__}, got {type(value).__name__}{hint and '; ' + hint}"
        )
