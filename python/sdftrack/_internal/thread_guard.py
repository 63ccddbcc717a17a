# SPDX-License-Identifier: MIT
"""Guards objects against concurrent use."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

__all__ = ["SingleThreadGuard", "one_thread", "reentrant_lock"]

P = ParamSpec("P")
T = TypeVar("T")


class Lock(Protocol):
    """A lock of the standard library, of either kind."""

    def acquire(self, blocking: bool = ...) -> bool: ...

    def release(self) -> None: ...


class SingleThreadGuard:
    """The lock of `what` for one call; raises an error immediately if another thread holds it."""

    __slots__ = ("_lock", "_what")

    def __init__(self, lock: Lock, what: str) -> None:
        self._lock, self._what = lock, what

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise RuntimeError(
                f"this {self._what} is in use by another thread; make one {self._what} per thread"
            )

    def __exit__(self, *_: object) -> None:
        self._lock.release()


def reentrant_lock() -> Lock:
    """A lock for `one_thread`: the thread that holds it may take it again."""
    return threading.RLock()


def one_thread(what: str) -> Callable[[Callable[Concatenate[Any, P], T]], Callable[Concatenate[Any, P], T]]:
    """Decorator of methods of `what`: one thread at a time, by the object's `_lock` (`reentrant_lock`)."""

    def guarded(method: Callable[Concatenate[Any, P], T]) -> Callable[Concatenate[Any, P], T]:
        @functools.wraps(method)
        def call(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> T:
            with SingleThreadGuard(self._lock, what):
                return method(self, *args, **kwargs)

        return call

    return guarded
