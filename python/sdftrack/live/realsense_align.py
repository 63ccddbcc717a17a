# SPDX-License-Identifier: MIT
"""Colour resampled into the depth image by the RealSense SDK."""

from __future__ import annotations

from typing import Any

__all__ = ["AlignedToDepth"]

TIMEOUT_MS = 1000  # the block works on this thread: its result is there at once


class AlignedToDepth:
    """Applies ``rs.align`` to a depth and a colour frame of two sensors.

    The filter takes a frameset, which pipelines make; here a processing block makes one of the two frames.
    """

    def __init__(self, rs: Any) -> None:
        self._pair: list[Any] = []
        self._sets = rs.frame_queue(1)
        self._block = rs.processing_block(self._collect)
        self._block.start(self._sets)
        self._align = rs.align(rs.stream.depth)

    def __call__(self, depth: Any, color: Any) -> Any:
        """The colour frame, in the geometry of the depth frame."""
        for frame in (depth, color):
            self._block.invoke(frame)
        both = self._sets.wait_for_frame(TIMEOUT_MS).as_frameset()
        return self._align.process(both).get_color_frame()

    def _collect(self, frame: Any, source: Any) -> None:
        self._pair.append(frame)
        if len(self._pair) == 2:
            pair, self._pair = self._pair, []
            source.frame_ready(source.allocate_composite_frame(pair))
