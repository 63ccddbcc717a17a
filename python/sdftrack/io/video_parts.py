# SPDX-License-Identifier: MIT
"""How a recording keeps its colour images in Matroska files: what their writer and their reader agree on.

``color.mkv`` has the images of a recording, and ``color_000123.mkv`` those from image 123 on, where it was continued.
The time of an image in a file is its number in the layout times `PERIOD_MS`, so that an image that is missing leaves a
gap and moves no other. Times of the recording are in the files of its layout.
"""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["CODEC", "PERIOD_MS", "is_part", "part_name", "parts_in"]

PERIOD_MS = 33
CODEC = "V_MPEG4/ISO/AVC"
_NAME = re.compile(r"color(?:_(\d{6,}))?\.mkv")


def part_name(first: int | None) -> str:
    """The file that begins with image `first`; None: the first file."""
    return "color.mkv" if first is None else f"color_{first:06d}.mkv"


def is_part(name: str) -> bool:
    return _NAME.fullmatch(name) is not None


def parts_in(folder: Path) -> dict[int, Path]:
    """The files by the number from which on they hold the images, ascending."""
    found = {}
    for path in folder.iterdir() if folder.is_dir() else ():
        name = _NAME.fullmatch(path.name)
        if name:
            found[-1 if name[1] is None else int(name[1])] = path
    return dict(sorted(found.items()))
