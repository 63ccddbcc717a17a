# SPDX-License-Identifier: MIT
"""A camera's clock against the computer's."""

from __future__ import annotations

import math

__all__ = ["CameraClock"]

SAME_CLOCK_S = 1.0  # a camera whose stamps are this near the time of arrival uses the computer's clock
FORGET = 1e-4  # a second per second: clocks drift apart by less


class CameraClock:
    """Estimates by how much the camera's clock differs from the computer's: the least difference on arrival.

    A camera whose stamps are the computer's time (RealSense with global time) has no difference.

    >>> clock = CameraClock()
    >>> clock.arrived(10.0, 5000.02)  # the camera counts from when it was switched on
    >>> clock.arrived(10.1, 5000.105)
    >>> round(clock.age_s(10.1, 5000.125), 6)
    0.02
    """

    def __init__(self) -> None:
        self._difference_s: float | None = None
        self._last = 0.0

    def arrived(self, stamp_s: float, now_s: float) -> None:
        """A frame taken at `stamp_s` of the camera's clock arrived at `now_s` of the computer's."""
        seen = now_s - stamp_s
        if 0 <= seen < SAME_CLOCK_S:
            self._difference_s = 0.0
        elif self._difference_s is None or now_s < self._last:
            self._difference_s = seen
        else:
            # Forgets slowly, so that two clocks that drift apart do not make every later frame look old.
            self._difference_s = min(seen, self._difference_s + FORGET * (now_s - self._last))
        self._last = now_s

    def age_s(self, stamp_s: float | None, now_s: float) -> float:
        """Age of a frame (s); NaN without a stamp, or before the first frame arrived."""
        if stamp_s is None or self._difference_s is None:
            return math.nan
        return now_s - stamp_s - self._difference_s
