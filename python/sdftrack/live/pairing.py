# SPDX-License-Identifier: MIT
"""Depth and colour images of two sensors, paired by their timestamps as they arrive."""

from __future__ import annotations

from collections import deque
from typing import Any

__all__ = ["Pairing"]

MAX_WAITING = 3  # depth images; later ones show that the colour images have stopped
KEPT = 8  # colour images


class Pairing:
    """Assigns to each depth image the colour image that is nearest in time, at most half a period away.

    Two streams of the same period: once a colour image is within half a period, no other one is nearer, so that
    nothing has to wait for the next one. A depth image whose colour image is missing is returned alone, as soon as a
    later colour image shows that it is.

    Parameters
    ----------
    period_s : float
        Period of the slower stream, seconds.

    Examples
    --------
    >>> pairing = Pairing(1 / 30)
    >>> pairing.add_color(0.001, "c0")
    >>> pairing.add_depth(0.0, "d0")
    >>> pairing.pop()
    (0.0, 'd0', 'c0')
    >>> pairing.add_depth(0.033, "d1")
    >>> pairing.pop() is None  # its colour may still come
    True
    """

    def __init__(self, period_s: float) -> None:
        self._half_s = 0.5 * period_s
        self._depth: deque[tuple[float, Any]] = deque()
        self._color: deque[tuple[float, Any]] = deque(maxlen=KEPT)

    def add_depth(self, stamp_s: float, image: Any) -> None:
        """A depth image taken at `stamp_s` seconds has arrived."""
        self._depth.append((stamp_s, image))

    def add_color(self, stamp_s: float, image: Any) -> None:
        """A colour image taken at `stamp_s` seconds has arrived."""
        self._color.append((stamp_s, image))

    def pop(self) -> tuple[float, Any, Any] | None:
        """(timestamp, depth, colour or None) of the oldest depth image; None while its colour may still arrive."""
        if not self._depth:
            return None
        stamp, depth = self._depth[0]
        found = min(self._color, key=lambda color: abs(color[0] - stamp), default=None)
        if found is not None and abs(found[0] - stamp) <= self._half_s:
            self._depth.popleft()
            return stamp, depth, found[1]
        passed = any(color[0] > stamp + self._half_s for color in self._color)
        if passed or len(self._depth) > MAX_WAITING:
            self._depth.popleft()
            return stamp, depth, None
        return None
