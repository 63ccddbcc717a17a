# SPDX-License-Identifier: MIT
"""Progress of a command: a bar on a terminal, lines in a pipe; with rate, remaining time and a note."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Protocol, TypeVar

T = TypeVar("T")
PLAIN_EVERY_S = 5.0  # a line of progress when the output is not a terminal


def progress(
    items: Iterable[T], total: int, label: str, quiet: bool, note: Callable[[], str] = lambda: ""
) -> Iterator[T]:
    """Report progress: a bar on a terminal, a line every few seconds in a pipe, nothing if quiet. Both have the rate,
    the remaining time and what `note` says at that moment."""
    with progress_counter(quiet) as tell:
        yield from counted(items, total, label, tell, note)


def counted(
    items: Iterable[T], total: int, label: str, tell: Tell, note: Callable[[], str] = lambda: ""
) -> Iterator[T]:
    for n, item in enumerate(items, 1):
        yield item
        tell(n, total, label, note())


class Tell(Protocol):
    """Progress callback: done, total, label, and a note that may change from call to call."""

    def __call__(self, done: int, total: int, label: str, note: str = "") -> None: ...


@contextlib.contextmanager
def progress_counter(quiet: bool) -> Iterator[Tell]:
    """The same for work that reports progress by a callback; a new label starts a new count."""
    if quiet:
        yield lambda done, total, label, note="": None
        return
    if not sys.stderr.isatty():
        yield _Lines().tell
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    texts = [
        TextColumn(text) for text in ("{task.description}", "{task.fields[rate]}", "{task.fields[note]}")
    ]
    columns = (texts[0], BarColumn(), MofNCompleteColumn(), texts[1], TimeRemainingColumn(), texts[2])
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, Any] = {}

        def move(done: int, total: int, label: str, note: str = "") -> None:
            if label not in tasks:
                tasks[label] = bar.add_task(label, total=total or None, rate="", note="")
            seconds = bar.tasks[tasks[label]].elapsed or 0.0
            bar.update(tasks[label], completed=done, rate=_rate(done, seconds), note=note)

        yield move


class _Lines:
    def __init__(self) -> None:
        self._label, self._began, self._last = "", 0.0, time.monotonic()

    def tell(self, done: int, total: int, label: str, note: str = "") -> None:
        now = time.monotonic()
        if label != self._label:
            self._label, self._began = label, self._last
        if done != total and now - self._last <= PLAIN_EVERY_S:
            return
        seconds = now - self._began
        left = f"{seconds / done * (total - done):.0f} s left" if 0 < done < total else f"{seconds:.1f} s"
        parts = [f"{done}/{total}" if total else f"{done}", _rate(done, seconds), left, note]
        print(f"{label}: {', '.join(p for p in parts if p)}", file=sys.stderr, flush=True)
        self._last = now


def _rate(done: int, seconds: float) -> str:
    return f"{done / seconds:.{0 if done > 10 * seconds else 1}f}/s" if done and seconds > 0 else ""
