# SPDX-License-Identifier: MIT
"""Objects that ``with`` closes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self


class ClosedByWith:
    """A base for classes with a method `close`: ``with`` calls it, also after an exception."""

    __slots__ = ()

    def close(self) -> None:
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


@contextmanager
def closed_on_error(*things: Any) -> Iterator[None]:
    """Whatever goes wrong within closes these before it goes on."""
    try:
        yield
    except BaseException:
        for thing in things:
            thing.close()
        raise
