# SPDX-License-Identifier: MIT
"""Clicks and drags on the image board, as pixels of the depth image."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sdftrack.viz.viewer.stage import Board

__all__ = ["BoardPointer"]

LEAST_PX = 4  # a smaller drag is a trembling hand: no box
BOX_RGB = (255, 230, 60)
LIFT = 0.002  # of the drawn box before the board, in distances

Pixel = tuple[float, float]


class BoardPointer:
    """Listens to one node that shows the image; a drag draws its box while it lasts.

    viser gives rays for clicks and points on a plane for drags; both are met with the board's plane, so the view may be
    turned as one likes.
    """

    def __init__(
        self,
        viser: Any,
        node: Any,
        board: Board,
        on_click: Callable[[float, float], None],
        on_box: Callable[[float, float, float, float], None],
    ) -> None:
        self._viser, self._board, self._on_box = viser, board, on_box
        self._line: Any = None

        # Coroutines run in the order of the events; plain functions would run in a pool of threads.
        async def clicked(event: Any) -> None:
            pixel = board.pixel(event.ray_origin, np.add(event.ray_origin, event.ray_direction))
            if pixel is not None and board.contains(*pixel):
                on_click(*pixel)

        async def dragged(event: Any) -> None:
            eye = event.client.camera.position
            a, b = board.pixel(eye, event.start_position), board.pixel(eye, event.end_position)
            if a is not None and b is not None:
                self._drag(self._inside(a), self._inside(b), event.phase == "end")

        node.on_click(clicked)
        node.on_drag("left")(dragged)

    def _inside(self, pixel: Pixel) -> Pixel:
        x, y = pixel
        return min(max(x, 0.0), self._board.width_px - 1.0), min(max(y, 0.0), self._board.height_px - 1.0)

    def _drag(self, a: Pixel, b: Pixel, ended: bool) -> None:
        x, y = min(a[0], b[0]), min(a[1], b[1])
        w, h = abs(a[0] - b[0]), abs(a[1] - b[1])
        if ended:
            if self._line is not None:
                self._line.visible = False
            if min(w, h) >= LEAST_PX:
                self._on_box(x, y, w, h)
            return
        lift = LIFT * self._board.center[2]
        corners = [self._board.point(*p, lift) for p in ((x, y), (x + w, y), (x + w, y + h), (x, y + h))]
        segments = np.array([[corners[i], corners[(i + 1) % 4]] for i in range(4)], np.float32)
        if self._line is None:
            self._line = self._viser.scene.add_line_segments(
                "/selection", segments, BOX_RGB, thickness=2.0, thickness_units="screen"
            )
        else:
            self._line.points, self._line.visible = segments, True
