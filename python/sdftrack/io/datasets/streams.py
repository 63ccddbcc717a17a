# SPDX-License-Identifier: MIT
"""Frames from a file that holds a depth stream and a colour stream, each with its own timestamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.frame import Frame


@dataclass(frozen=True)
class Stream:
    """The images of one sensor: ascending timestamps, and `read(i)`: (H, W) uint16 depth units or (H, W, 3) uint8 RGB.

    `read` raises ValueError with the reason if an image cannot be read.
    """

    stamps_s: NDArray[np.float64]
    read: Callable[[int], NDArray[Any]]


class StreamFrames:
    """One frame per depth image; unreadable ones are returned as `Frame.unreadable` with the reason.

    Reading is locked: files and their decoders are not made for several threads.
    """

    def __init__(self, name: str, depth: Stream, color: Stream | None, depth_scale: float) -> None:
        if not len(depth.stamps_s):
            raise ValueError(f"{name}: the recording has no depth images, which the trackers require")
        self._name, self._depth, self._color, self._scale = name, depth, color, depth_scale
        stamps = color.stamps_s if color is not None else np.empty(0)
        self._nearest = nearest_in_time(depth.stamps_s, stamps)
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self._depth.stamps_s)

    def __getitem__(self, i: int) -> Frame:
        stamp = float(self._depth.stamps_s[i])
        try:
            with self._lock:
                units, color = self._depth.read(i), None
                if self._color is not None and self._nearest[i] >= 0:
                    color = self._color.read(int(self._nearest[i]))
            return Frame(units, color, stamp, depth_scale=self._scale, index=i, check_units=False)
        except (ValueError, TypeError, OSError) as error:
            return Frame.unreadable(f"{self._name}, frame {i}: {error}", stamp, i)


def nearest_in_time(stamps_s: NDArray[np.float64], others_s: NDArray[np.float64]) -> NDArray[np.intp]:
    """Index of the nearest of `others_s` for each of `stamps_s`, at most half a period of the slower stream away.

    Both ascending, in seconds; -1 where there is none.
    """
    if not len(others_s):
        return np.full(len(stamps_s), -1)
    after = np.searchsorted(others_s, stamps_s).clip(1, max(1, len(others_s) - 1))
    before = after - 1
    after = np.minimum(after, len(others_s) - 1)
    left, right = np.abs(others_s[before] - stamps_s), np.abs(others_s[after] - stamps_s)
    nearest = np.where(left <= right, before, after)
    periods = [float(np.median(np.diff(times))) for times in (stamps_s, others_s) if len(times) > 1]
    limit = 0.5 * max(periods, default=1 / 30)
    return np.where(np.minimum(left, right) <= limit * (1 + 1e-9), nearest, -1)
