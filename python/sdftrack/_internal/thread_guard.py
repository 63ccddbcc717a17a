# SPDX-License-Identifier: MIT
"""Guards objects against concurrent use."""

from __future__ import annotations

import contextlib
import functools
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, Concatenate, Literal, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
Kind = Literal["changes", "brief", "reads"]


class ReentrantLock:
    """A lock for `one_thread`: the thread that holds it may take it again."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._kind: Kind | None = None  # of the outermost call that holds it

    @contextlib.contextmanager
    def held(self, kind: Kind, what: str) -> Iterator[None]:
        """Hold it for a call of this kind; see `one_thread`."""
        while not self._lock.acquire(blocking=False):
            now = self._kind
            if now == "reads" or (now == "brief" and kind == "reads"):
                self._lock.acquire()
                break
            if now is not None:
                raise RuntimeError(f"this {what} is in use by another thread; make one {what} per thread")
            time.sleep(0)  # it is just being taken or given back
        outer, self._kind = self._kind, self._kind or kind
        try:
            yield
        finally:
            self._kind = outer
            self._lock.release()


def one_thread(
    what: str, kind: Kind = "changes"
) -> Callable[[Callable[Concatenate[Any, P], T]], Callable[Concatenate[Any, P], T]]:
    """Decorator of methods of `what`: one thread at a time, by the object's `_lock`, a `ReentrantLock`.

    A call that "reads", as a viewer does from its own thread, must not make that of another thread fail: what comes
    meanwhile waits, and it waits for a "brief" call. Other calls from two threads at once are an error.
    """

    def guarded(method: Callable[Concatenate[Any, P], T]) -> Callable[Concatenate[Any, P], T]:
        @functools.wraps(method)
        def call(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> T:
            with self._lock.held(kind, what):
                return method(self, *args, **kwargs)

        return call

    return guarded
