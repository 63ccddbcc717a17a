# SPDX-License-Identifier: MIT
"""Nested dictionaries and lists of numbers, text, bytes and arrays, as JSON and named arrays."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["pack", "unpack"]

# Keys of the JSON objects that stand for what JSON has not: {"$array": name}, {"$bytes": name}, {"$float": "nan"}.
ARRAY, BYTES, FLOAT = "$array", "$bytes", "$float"


def pack(content: Any) -> tuple[Any, dict[str, NDArray[Any]]]:
    """JSON values, and the arrays that they refer to; an array is named by its place (``shapes/0/values``)."""
    arrays: dict[str, NDArray[Any]] = {}

    def packed(value: Any, place: str) -> Any:
        if isinstance(value, np.ndarray | bytes):
            key = BYTES if isinstance(value, bytes) else ARRAY
            arrays[place] = np.frombuffer(value, np.uint8) if isinstance(value, bytes) else value
            return {key: place}
        if isinstance(value, enum.Enum):
            value = value.value
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, dict):
            wrong = [key for key in value if not isinstance(key, str) or key.startswith("$")]
            if wrong:
                raise TypeError(f"expected names as keys, got {wrong[0]!r}")
            return {key: packed(each, _within(place, key)) for key, each in value.items()}
        if isinstance(value, list | tuple):
            return [packed(each, _within(place, i)) for i, each in enumerate(value)]
        if isinstance(value, float) and not math.isfinite(value):
            return {FLOAT: repr(value)}
        if value is None or isinstance(value, str | bool | int | float):
            return value
        raise TypeError(f"expected numbers, text, bytes and arrays, got {type(value).__name__}")

    return packed(content, ""), arrays


def unpack(tree: Any, read: Callable[[str], NDArray[Any]]) -> Any:
    """What `pack` was given, with lists for tuples; ValueError if an array is referred to twice."""
    known: set[str] = set()

    def array(name: Any) -> NDArray[Any]:
        if not isinstance(name, str) or name in known:
            raise ValueError("an array that is referred to twice")
        known.add(name)
        return read(name)

    def unpacked(value: Any) -> Any:
        if isinstance(value, list):
            return [unpacked(each) for each in value]
        if not isinstance(value, dict):
            return value
        if len(value) == 1:
            ((key, inner),) = value.items()
            if key == ARRAY:
                return array(inner)
            if key == BYTES:
                return array(inner).tobytes()
            if key == FLOAT:
                return float(inner)
        return {key: unpacked(each) for key, each in value.items()}

    return unpacked(tree)


def _within(place: str, key: str | int) -> str:
    return f"{place}/{key}" if place else str(key)
