# SPDX-License-Identifier: MIT
"""Which tests `python -m pytest` leaves to the night: the table nightly.txt."""

from __future__ import annotations

import fnmatch
import functools
from pathlib import Path

TESTS = Path(__file__).resolve().parent
TABLE = TESTS / "nightly.txt"


@functools.cache
def lines() -> tuple[str, ...]:
    """Files of tests/, and FILE::TEST with patterns of tests."""
    written = (line.partition("#")[0].strip() for line in TABLE.read_text().splitlines())
    return tuple(line for line in written if line)


@functools.cache
def whole_files() -> frozenset[Path]:
    return frozenset(TESTS / line for line in lines() if "::" not in line)


@functools.cache
def patterns(path: Path) -> tuple[str, ...]:
    """Patterns of the tests of a file that are in the table one by one."""
    here = [line.split("::", 1) for line in lines() if "::" in line]
    return tuple(pattern for file, pattern in here if TESTS / file == path)


def is_nightly(path: Path, test: str) -> bool:
    """Whether a test, as pytest names it within its file, is in the table."""
    names = (test, test.partition("[")[0])
    # A bracket is that of a parameter, not of a set of characters.
    escaped = [pattern.replace("[", "[[]") for pattern in patterns(path)]
    return path in whole_files() or any(
        fnmatch.fnmatchcase(name, pattern) for pattern in escaped for name in names
    )
