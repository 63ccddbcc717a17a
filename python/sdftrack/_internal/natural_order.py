# SPDX-License-Identifier: MIT
"""The order of files by the numbers in their names, which scripts often write without leading zeros."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

NUMBERS = re.compile(r"(\d+)")
TIME = re.compile(r"(?:\D*?)(\d+\.\d+)")  # a whole name, with or without a word before the seconds


def natural(name: str) -> tuple[Any, ...]:
    """Sort key of a name: its numbers by value, what follows the dot of a name that is a time as decimals.

    >>> sorted(["d_10", "d_9", "d_0008"], key=natural), sorted(["10.03", "9.5", "9.12"], key=natural)
    (['d_0008', 'd_9', 'd_10'], ['9.12', '9.5', '10.03'])
    """
    parts: list[Any] = NUMBERS.split(name)
    decimals = TIME.fullmatch(name) is not None
    for i in range(1, len(parts), 2):
        parts[i] = float(f"0.{parts[i]}") if decimals and i == 3 else int(parts[i])
    return (*parts, name)


def in_order(files: Iterable[Path]) -> list[Path]:
    """Files in the order of their folders, then of their names without the suffix."""
    return sorted(files, key=lambda file: (natural(str(file.parent)), natural(file.stem), file.suffix))
