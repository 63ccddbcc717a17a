# SPDX-License-Identifier: MIT
"""Where things stand in the page's 3-D view: the scene, the image on a board beside it, and clicks on the board."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

GAP = 0.06  # between the board and the scene, in widths of the board
FOV_RAD = math.radians(50)  # vertical, of the page's view
ASPECT = 1.3  # of the part of a page that shows the scene; a narrower one needs the mouse wheel
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Board:
    """The camera image as a rectangle that faces the camera, left of what the camera sees; camera frame, m."""

    center: tuple[float, float, float]
    width_m: float
    height_m: float
    width_px: int
    height_px: int

    def pixel(self, origin: Any, through: Any) -> tuple[float, float] | None:
        """Pixel (x, y) that a ray from `origin` through a point meets; None: it misses the board's plane.

        Pixels beyond the board's border are returned as they are.
        """
        a, b = np.asarray(origin, np.float64), np.asarray(through, np.float64)
        step = b - a
        if abs(step[2]) < 1e-12:
            return None
        share = (self.center[2] - a[2]) / step[2]
        if share <= 0:
            return None
        hit = a + share * step - np.asarray(self.center)
        x = (hit[0] / self.width_m + 0.5) * self.width_px - 0.5
        y = (hit[1] / self.height_m + 0.5) * self.height_px - 0.5
        return float(x), float(y)

    def point(self, x_px: float, y_px: float, lift_m: float = 0.0) -> Array:
        """Point (3,) of a pixel, `lift_m` in front of the board; camera frame, m."""
        return np.array(
            [
                self.center[0] + ((x_px + 0.5) / self.width_px - 0.5) * self.width_m,
                self.center[1] + ((y_px + 0.5) / self.height_px - 0.5) * self.height_m,
                self.center[2] - lift_m,
            ]
        )

    def contains(self, x_px: float, y_px: float) -> bool:
        return -0.5 <= x_px < self.width_px - 0.5 and -0.5 <= y_px < self.height_px - 0.5


def scene_distance(depth: NDArray[np.float32] | None, poses: Array | None) -> float | None:
    """Distance (m) of what matters: the tracked objects, else the median of the depth; None: nothing is known."""
    if poses is not None:
        z = poses[:, 2, 3]
        z = z[np.isfinite(z) & (z > 0)]
        if z.size:
            return float(np.median(z))
    if depth is not None:
        sample = depth[::8, ::8]
        sample = sample[sample > 0]
        if sample.size:
            return float(np.median(sample))
    return None


def place_board(lens: Any, distance_m: float) -> Board:
    """A board as large as what the camera sees at this distance. `lens`: the depth camera."""
    width, height = int(lens.width), int(lens.height)
    width_m = distance_m * width / float(lens.K[0, 0])
    return Board((-(1 + GAP) * width_m, 0.0, distance_m), width_m, width_m * height / width, width, height)


def initial_view(board: Board) -> tuple[Array, Array]:
    """Position and look-at point (m, camera frame) of a view of board and scene."""
    middle = np.array([-(1 + GAP) * board.width_m / 2, 0.0, board.center[2]])
    wide = (2 + 3 * GAP) * board.width_m / (2 * math.tan(FOV_RAD / 2) * ASPECT)
    high = 1.1 * board.height_m / (2 * math.tan(FOV_RAD / 2))
    return middle - [0.0, 0.0, max(wide, high)], middle


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
