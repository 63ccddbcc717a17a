# SPDX-License-Identifier: MIT
"""A camera with faults: what drivers, cables and hubs do to a stream of frames."""

import time
from collections.abc import Iterable, Iterator
from typing import Any

from sdftrack.frame import Frame
from sdftrack.live.camera import CameraLost

FPS = 30.0  # of the timestamps


class FaultyCamera:
    """A sequence as a camera that stalls (frame: seconds), repeats, reorders and drops frames, or is unplugged.

    Frames are delivered at once unless `real_time`.
    """

    def __init__(
        self,
        sequence: Any,
        *,
        drop: Iterable[int] = (),
        repeat: Iterable[int] = (),
        swap: Iterable[int] = (),
        stall: dict[int, float] | None = None,
        unplugged: range = range(0),
        real_time: bool = True,
    ) -> None:
        self.camera, self.name = sequence.camera, "camera with faults"
        self._sequence = sequence
        self._order = _order(len(sequence), set(drop), set(repeat), set(swap))
        self._stall, self._unplugged = stall or {}, unplugged
        self._real_time = real_time
        self._start = time.time()
        self._away_until = 0.0
        self._been_away = False

    def read(self) -> Frame | None:
        i = next(self._order, None)
        while i is not None and i in self._unplugged and self._been_away:
            i = next(self._order, None)
        if i is None:
            return None
        if i in self._unplugged:
            self._been_away = True
            self._away_until = self._start + (self._unplugged.stop / FPS if self._real_time else 0)
            raise CameraLost("no frame for 1 s; is the cable connected?")
        time.sleep(self._stall.get(i, 0.0))
        stamp = self._start + i / FPS
        if self._real_time:
            time.sleep(max(0.0, stamp - time.time()))
        return self._sequence[i].replace(timestamp=stamp)

    def reopen(self) -> None:
        if time.time() < self._away_until:
            raise CameraLost("not connected")

    def close(self) -> None:
        self._sequence.close()


def _order(count: int, drop: set[int], repeat: set[int], swap: set[int]) -> Iterator[int]:
    numbers = list(range(count))
    for i in sorted(swap):
        if i + 1 < count:
            numbers[i], numbers[i + 1] = numbers[i + 1], numbers[i]
    for i in numbers:
        if i not in drop:
            yield i
            if i in repeat:
                yield i
