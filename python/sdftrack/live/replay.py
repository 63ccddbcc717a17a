# SPDX-License-Identifier: MIT
"""A recorded sequence played as if it came from a camera."""

from __future__ import annotations

import time
from typing import Any

from sdftrack.frame import Frame
from sdftrack.io.datasets import open_sequence
from sdftrack.live.camera import register_camera


class Replay:
    """Plays a sequence at its own rate, with today's timestamps, which increase even if the clock is set back. `fps`:
    by default that of the sequence's timestamps, else 30; ``inf``: as fast as frames are taken. `hold`: the first frame
    is repeated until `resume`."""

    def __init__(
        self, sequence: Any, fps: float | None = None, loop: bool = False, hold: bool = False
    ) -> None:
        if fps is not None and not fps > 0:
            raise ValueError(f"fps: expected frames per second above 0, got {fps!r}")
        self.camera = sequence.camera
        self.name = f"replay of {sequence.name or sequence.layout}"
        self._sequence, self._loop, self._hold = sequence, loop, hold
        self._step_s = 1 / (fps or 30)
        first = [sequence[i].timestamp for i in range(min(2, len(sequence)))] if fps is None else []
        if len(first) == 2 and None not in first and 1e-4 < first[1] - first[0] < 10:
            self._step_s = float(first[1] - first[0])
        self._next, self._due = 0, 0.0
        self._today = time.time() - time.monotonic()

    def read(self) -> Frame | None:
        if self._next == len(self._sequence):
            if not self._loop:
                return None
            self._next = 0
        frame = self._sequence[self._next]
        self._next += not self._hold
        now = time.monotonic()
        # Frames that reading has made late are not hurried after: a camera would have had them at their time.
        self._due = max(self._due + self._step_s, now) if self._due else now
        time.sleep(max(0.0, self._due - now))
        return frame.replace(timestamp=self._today + self._due)

    def resume(self) -> None:
        self._hold = False

    def reopen(self) -> None:
        pass

    def close(self) -> None:
        self._sequence.close()


@register_camera("replay", "a recorded sequence")
def open_replay(
    address: str,
    *,
    fps: float | None = None,
    loop: bool = False,
    hold: bool = False,
    width: int | None = None,
    height: int | None = None,
    **layout: Any,
) -> Replay:
    sequence = open_sequence(address, **layout)
    depth = sequence.camera.depth
    if (width or depth.width, height or depth.height) != (depth.width, depth.height):
        sequence.close()
        raise ValueError(
            f"width, height: the recording {address} has {depth.width} x {depth.height}, got {width} x {height}"
        )
    return Replay(sequence, fps, loop, hold)
