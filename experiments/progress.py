# SPDX-License-Identifier: MIT
"""Progress of an experiment: it calls `step`, and the runner decides where that is shown."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from sdftrack.cli.progress import progress_counter

_tell: Any = None


def step(done: int, total: int, label: str) -> None:
    """`done` of `total` are done of the work of that name."""
    if _tell is not None:
        _tell(done, total, label)


@contextmanager
def shown(quiet: bool) -> Iterator[None]:
    """While this is open, steps are shown as the commands of the package show theirs."""
    global _tell
    before = _tell
    with progress_counter(quiet) as _tell:
        try:
            yield
        finally:
            _tell = before
