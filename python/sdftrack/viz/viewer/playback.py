# SPDX-License-Identifier: MIT
"""Frames of a recording in the viewer, chosen by a slider or played."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any

__all__ = ["Playback"]


class Playback:
    """A slider and a play button; a thread loads the frame that was asked for last.

    Parameters
    ----------
    viewer : Viewer
        Closing it ends the playback.
    count : int
        Number of frames.
    show : function (i)
        Loads frame i and hands it to the viewer; called in this object's thread only.
    fps : float
        Frames per second while playing, if `show` is fast enough.

    Attributes
    ----------
    index : int
        The frame shown last; -1 before the first.
    """

    def __init__(self, viewer: Any, count: int, show: Callable[[int], None], fps: float) -> None:
        self._count, self._show, self._period_s = count, show, 1 / fps
        self.index, self._due = -1, 0.0
        self._wanted, self._playing, self._closed = 0, False, False
        self._changed = threading.Condition()
        gui = viewer._server.viser.gui
        self._slider = gui.add_slider("frame", 0, max(count - 1, 1), 1, 0, disabled=count < 2)
        self._button = gui.add_checkbox("play", False, disabled=count < 2)

        async def moved(event: Any) -> None:
            if event.client is not None:  # by a user, not by playing
                self.go_to(int(self._slider.value))

        async def pressed(_: Any) -> None:
            self.play(bool(self._button.value))

        self._slider.on_update(moved)
        self._button.on_update(pressed)
        self._thread = threading.Thread(target=self._work, name="sdftrack playback", daemon=True)
        self._thread.start()
        viewer._at_close.append(self.close)

    def go_to(self, i: int) -> None:
        """Show frame `i`."""
        with self._changed:
            self._wanted = min(max(i, 0), self._count - 1)
            self._changed.notify()

    def play(self, on: bool) -> None:
        with self._changed:
            self._playing = on and self._count > 1
            self._changed.notify()

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=10)

    def _work(self) -> None:
        while (step := self._next()) is not None:
            i, playing = step
            try:
                self._show(i)
            except Exception:  # one frame that cannot be read does not end the others
                logging.getLogger("sdftrack").warning("viewer: frame %d was not shown", i, exc_info=True)
            self.index = i
            if playing:
                self._slider.value = i

    def _next(self) -> tuple[int, bool] | None:
        """Wait for the next frame to show, and whether playing came to it; None: closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._playing or self._wanted != self.index)
            playing = self._playing and self._wanted == self.index
            if playing:
                self._changed.wait_for(
                    lambda: self._closed or not self._playing or self._wanted != self.index,
                    self._due - time.monotonic(),
                )
                if self._playing and self._wanted == self.index:
                    self._wanted = (self.index + 1) % self._count
            self._due = time.monotonic() + self._period_s
            return None if self._closed else (self._wanted, playing)
