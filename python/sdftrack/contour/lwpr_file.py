# SPDX-License-Identifier: MIT
"""The state of an LWPR as the content of its file."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdftrack._internal.saved_file import FileKind

KIND = FileKind("sdftrack.LWPR", 1, "LWPR.save")


def content_of(state: dict[str, Any]) -> dict[str, Any]:
    """Content of a file, from ``LWPR.__getstate__``; lists of numbers, which may be a whole metric, as arrays."""
    parameters = {
        name: np.array(value) if isinstance(value, list) else value
        for name, value in plain(state["parameters"]).items()
    }
    return {**state, "parameters": parameters}


def state_from(content: dict[str, Any]) -> dict[str, Any]:
    """What ``LWPR.__setstate__`` takes, from the content of a file."""
    return {**content, "parameters": plain(content["parameters"])}


def plain(value: Any) -> Any:
    """Convert numpy numbers and arrays, also inside lists and dictionaries, to plain Python types for JSON."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, dict):
        return {name: plain(v) for name, v in value.items()}
    return value
