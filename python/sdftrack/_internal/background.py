# SPDX-License-Identifier: MIT
"""Work that a loop hands to another thread: done in order, its errors raised in the loop."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Generic, TypeVar

T = TypeVar("T")
_END: Any = object()


class Background(Generic[T]):
    """Calls `work(item)` for one item after the other on a thread of its own, with at most `waiting` that wait.
    `dropped`: how many found no place, and nobody waited."""

    def __init__(self, work: Callable[[T], object], waiting: int, name: str) -> None:
        self.dropped = 0
        self._work = work
        self._items: queue.Queue[T] = queue.Queue(waiting)
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, item: T, wait: bool = True) -> bool:
        """Hand over an item; returns False if it was dropped. Raises the error of an earlier one."""
        self._raise()
        try:
            self._items.put(item, block=wait)
        except queue.Full:
            self.dropped += 1
            return False
        self._raise()
        return True

    def close(self) -> None:
        """Wait until everything is done; raises the error of an item. A second call does nothing."""
        if self._thread.is_alive():
            self._items.put(_END)
            self._thread.join()
        self._raise()

    def _raise(self) -> None:
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def _run(self) -> None:
        failed = False
        while (item := self._items.get()) is not _END:
            if not failed:  # afterwards items are only taken, so that nobody waits for a place
                try:
                    self._work(item)
                except BaseException as error:
                    self._error, failed = error, True
            del item  # not kept while waiting for the next one


def read_ahead(items: Iterable[T], waiting: int = 4) -> Generator[T, None, None]:
    """The items, taken by a thread of its own before they are asked for; at most `waiting` are held. Closing the
    iterator, or its end, stops the thread."""
    source = iter(items)
    with ThreadPoolExecutor(1, "read ahead") as pool:
        taken = deque(pool.submit(next, source, _END) for _ in range(waiting))
        try:
            while (item := taken.popleft().result()) is not _END:
                taken.append(pool.submit(next, source, _END))
                yield item
                del item
        finally:
            pool.shutdown(cancel_futures=True)
