# SPDX-License-Identifier: MIT
"""Which tests `python -m pytest` leaves to the night: the table nightly.txt."""

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


@functools.cache
def patterns(path: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Patterns of the tests of a file that are left to the night, and of those among them that stay."""
    left, kept = [], []
    for line in lines():
        file, _, pattern = line.removeprefix(BUT).partition("::")
        if fnmatch.fnmatchcase(path.as_posix(), (TESTS / file).as_posix()):
            # A bracket is that of a parameter, not of a set of characters.
            (kept if line.startswith(BUT) else left).append(pattern.replace("[", "[[]") or "*")
    return tuple(left), tuple(kept)


def is_nightly(path: Path, test: str) -> bool:
    """Whether a test, as pytest names it within its file, is left to the night."""
    names = (test, test.partition("[")[0])
    left, kept = (
        any(fnmatch.fnmatchcase(name, pattern) for pattern in side for name in names)
        for side in patterns(path)
    )
    return left and not kept


def is_left_whole(path: Path) -> bool:
    """Whether nothing of a file is in the first tier."""
    left, kept = patterns(path)
    return "*" in left and not kept
