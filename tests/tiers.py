# SPDX-License-Identifier: MIT
"""Which tests `python -m pytest` leaves to the night: the table nightly.txt."""

from __future__ import annotations

import fnmatch
import functools
from pathlib import Path

TESTS = Path(__file__).resolve().parent
TABLE = TESTS / "nightly.txt"


BUT = "but "


@functools.cache
def lines() -> tuple[str, ...]:
    """FILE, FILE::TEST and "but FILE::TEST", files of tests/."""
    written = (line.partition("#")[0].strip() for line in TABLE.read_text().splitlines())
    return tuple(line for line in written if line)


def _matches(path: Path, test: str, line: str) -> bool:
    file, _, pattern = line.partition("::")
    # A bracket is that of a parameter, not of a set of characters.
    escaped = pattern.replace("[", "[[]") or "*"
    return fnmatch.fnmatchcase(path.as_posix(), (TESTS / file).as_posix()) and any(
        fnmatch.fnmatchcase(name, escaped) for name in (test, test.partition("[")[0])
    )


def is_nightly(path: Path, test: str) -> bool:
    """Whether a test, as pytest names it within its file, is left to the night."""
    left = [line for line in lines() if not line.startswith(BUT)]
    kept = [line.removeprefix(BUT) for line in lines() if line.startswith(BUT)]
    return any(_matches(path, test, line) for line in left) and not any(
        _matches(path, test, line) for line in kept
    )


@functools.cache
def is_left_whole(path: Path) -> bool:
    """Whether nothing of a file is in the first tier."""
    left = [line for line in lines() if "::" not in line and _matches(path, "", line)]
    return bool(left) and not any(
        _matches(path, "*", f"{line.removeprefix(BUT).partition('::')[0]}")
        for line in lines()
        if line.startswith(BUT)
    )
