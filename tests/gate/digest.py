# SPDX-License-Identifier: MIT
"""Short hashes of results: equal exactly when all bits are."""

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np

import sdftrack as st

Hashes = dict[str, str]
CAMERA = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)

TRACKED = (
    "poses",
    "covariances",
    "status",
    "reason",
    "confidence",
    "twists",
    "inliers",
    "runner_up",
    "energy",
    "steps",
)


def digest(*values: Any) -> str:
    """16 hexadecimal digits of arrays, numbers, strings, and lists, tuples and dicts of them."""
    out = hashlib.sha256()
    for value in values:
        _add(out, value)
    return out.hexdigest()[:16]


def _add(out: Any, value: Any) -> None:
    if isinstance(value, dict):
        for key in sorted(value):
            _add(out, key)
            _add(out, value[key])
    elif isinstance(value, (list, tuple)):
        out.update(f"[{len(value)}]".encode())
        for item in value:
            _add(out, item)
    elif value is None or isinstance(value, (str, bool)):
        out.update(f"{type(value).__name__}:{value!s};".encode())
    else:
        array = np.ascontiguousarray(value)
        if array.dtype.kind == "f":
            array = np.where(np.isnan(array), np.array(np.nan, array.dtype), array)  # one NaN for all
        out.update(f"{array.dtype.str}{array.shape};".encode() + array.tobytes())


def tracked(results: Iterable[Any]) -> dict[str, str]:
    """A hash for each kind of output of a list of `TrackResult`."""
    many = list(results)
    out = {}
    for name in TRACKED:
        values = [getattr(r, name) for r in many]
        if name == "status":
            values = [[str(s.value) for s in v] for v in values]
        if name == "steps":
            values = [[np.asarray(list(map(tuple, s)), float) for s in v] for v in values]
        out[name] = digest(values)
    return out


def mesh(value: Any) -> str:
    """Of a mesh: vertices, faces and colours."""
    return digest(value.vertices, value.faces, value.colors)
