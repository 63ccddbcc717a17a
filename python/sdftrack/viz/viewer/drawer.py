# SPDX-License-Identifier: MIT
"""A thread that draws the newest of what it is given, and nothing while nobody looks."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Drawer(Generic[T]):
    """Calls `draw(item)` in a thread of its own, at most `max_hz` times per second, while it is `watched`."""

    # Otherwise only the newest item is kept. An exception is logged and kept in `error`; the thread goes on. `drawn`
    # and `replaced` count items drawn, and items that a newer one replaced.

    def __init__(self, draw: Callable[[T], None], watched: Callable[[], bool], max_hz: float) -> None:
        self._draw, self._watched, self._period_s = draw, watched, 1 / max_hz
        self.drawn = self.replaced = 0
        self.error: Exception | None = None
        self._waiting: T | None = None
        self._last: T | None = None
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._work, name="sdftrack viewer", daemon=True)
        self._thread.start()

    def offer(self, item: T) -> None:
        """Hand over an item; returns at once."""
        with self._changed:
            self.replaced += self._waiting is not None
            self._waiting = item
            if self._watched():  # else whoever comes calls `again`
                self._changed.notify()

    def again(self) -> None:
        """Draw the last item once more, if there is no newer one: somebody came, or a setting changed."""
        with self._changed:
            if self._waiting is None:
                self._waiting = self._last
            self._changed.notify()

    def wait_for_newer(self, seconds: float) -> bool:
        """Wait until an item is handed over, or the end comes; False: neither, so long."""
        with self._changed:
            return self._changed.wait_for(lambda: self._closed or self._waiting is not None, seconds)

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=10)

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(
                    lambda: self._closed or (self._waiting is not None and self._watched())
                )
                if self._closed:
                    return
                item, self._waiting = self._waiting, None
                self._last = item
            assert item is not None
            began = time.monotonic()
            try:
                self._draw(item)
                self.drawn += 1
            except Exception as error:
                self.error = error
                logging.getLogger("sdftrack").warning("viewer: a frame was not drawn", exc_info=True)
            with self._changed:  # closing ends the wait
                self._changed.wait_for(lambda: self._closed, began + self._period_s - time.monotonic())
