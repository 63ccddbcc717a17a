# SPDX-License-Identifier: MIT
"""Guards objects against concurrent use."""

from __future__ import annotations

import threading

__all__ = ["SingleThreadGuard"]


class SingleThreadGuard:
    """The lock of `what` for one call; raises an error immediately if another thread holds it."""

    __slots__ = ("_lock", "_what")

    def __init__(self, lock: threading.Lock, what: str) -> None:
        self._lock, self._what = lock, what

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise RuntimeError(
                f"this {self._what} is in use by another thread; make one {self._what} per thread"
            )

    def __exit__(self, *_: object) -> None:
        self._lock.release()
