# SPDX-License-Identifier: MIT
"""The known layouts of recorded sequences, and registration of readers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sdftrack.io.datasets.sequence import Sequence

__all__ = ["LAYOUTS", "Layout", "register"]


@dataclass(frozen=True)
class Layout:
    """Detection and reader of a layout."""

    name: str
    marks: str
    detect: Callable[[Path], bool]
    open: Callable[[Path], Sequence]


LAYOUTS: dict[str, Layout] = {}


def register(
    name: str, marks: str, detect: Callable[[Path], bool]
) -> Callable[[Callable[[Path], Sequence]], Callable[[Path], Sequence]]:
    """Decorator that makes `function(path) -> Sequence` the reader of layout `name`.

    `marks` briefly names the files by which `detect(path)` recognises the layout, for messages.
    """

    def add(function: Callable[[Path], Sequence]) -> Callable[[Path], Sequence]:
        LAYOUTS[name] = Layout(name, marks, detect, function)
        return function

    return add
