# SPDX-License-Identifier: MIT
"""The known layouts of recorded sequences, and registration of readers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sdftrack.io.datasets.sequence import Sequence

Reader = Callable[..., Sequence]


@dataclass(frozen=True)
class Layout:
    """Detection and reader of a layout, and the keyword arguments that the reader takes besides the path."""

    name: str
    marks: str
    detect: Callable[[Path], bool]
    open: Reader
    options: tuple[str, ...] = ()


LAYOUTS: dict[str, Layout] = {}


def register(
    name: str, marks: str, detect: Callable[[Path], bool], options: tuple[str, ...] = ()
) -> Callable[[Reader], Reader]:
    """Decorator that makes `function(path, **options) -> Sequence` the reader of layout `name`.

    `marks` briefly names the files by which `detect(path)` recognises the layout, for messages. The path is a folder
    or a file.
    """

    def add(function: Reader) -> Reader:
        LAYOUTS[name] = Layout(name, marks, detect, function, options)
        return function

    return add
