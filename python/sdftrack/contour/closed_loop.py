# SPDX-License-Identifier: MIT
"""A contour tracker and a memory of shapes, closed to a loop (thesis 6.3.4; docs/shape_memory.md, "In a video").

An occluder that comes in from one side takes area away, and the grid of a tracker that knows no better moves and
shrinks with what is left. So a frame is held against the course that the object has been on: where area is suddenly
missing, the remembered silhouettes are laid over the colours of the image around the place where the object should
be, and the best one says what is hidden. What was seen whole is learned some frames later, once nothing has come in
between.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.alignment import FRAME, Found, find
from sdftrack.contour.course import Course, Expected
from sdftrack.contour.memory import ShapeMemory
from sdftrack.contour.placement import Placement, placement_of, put_back, seen_from

__all__ = ["ClosedLoop"]

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Picture: TypeAlias = NDArray[np.float32]

LEAST_LOSS = 0.05  # share of the area that must be missing suddenly before an occluder is thought of
LOSSES = 5.0
LEARNT_AFTER = (
    10  # frames that a silhouette waits: what an occluder has begun to cover is not learned as whole
)
NEAR_PX = (
    2.5  # of a 64 x 64 frame, around the expected silhouette: what of the object's colours is taken for it
)
OFF_PX = (1.5, 8.0)  # distances between which the object's colours stick out of the expected silhouette
SMOOTHED_PX = 1.0  # of the posterior, before it is cut at one half
LEAST_KNOWN = 0.2  # mean |2 p - 1| around a pixel; where it is less, the colours are of neither side
LEAST_SEEN = 12  # pixels of the frame; fewer say nothing
LEAST_PIECE = (
    0.25  # of the largest hidden piece: smaller ones are limbs in another pose, not further occluders
)
LEAST_WEIGHT = 0.02  # of a frame with next to everything hidden, in the course


class ClosedLoop:
    """What the memory makes of each frame's mask, for `ContourTracker`.

    Parameters
    ----------
    memory : ShapeMemory
        With ``rule="remembered"``.
    """

    def __init__(self, memory: ShapeMemory) -> None:
        self._memory = memory

    def begin(self, mask: Mask, warp: Array) -> None:
        """The mask (ny, nx) of the first frame, whole, on a grid that `warp` (3, 3) takes to the image."""
        self._time, self._lost = 0, False
        self._course = Course()
        self._waiting: deque[Mask] = deque()
        self._size_px = 0.0
        self._last: Mask = self._whole(mask, warp)

    def learn(self, mask: Mask, warp: Array) -> None:
        """A mask that is known to be whole: the burn-in."""
        self._time += 1
        self._lost = False
        self._memory.learn(self._whole(mask, warp))

    def lost(self) -> None:
        """A frame without a mask."""
        self._time += 1
        self._lost = True
        self._waiting.clear()

    def judge(
        self, mask: Mask, warp: Array, sure: bool, look: Callable[[], Picture]
    ) -> tuple[str, Mask | None]:
        """The judgement, and the whole silhouette on the grid where it is "occluded".

        `sure`: the colours inside and beside the outline are those of the start; else nothing is learned.
        `look()` gives the posterior (ny, nx) float32 of the object's colours at every cell; it is asked for only
        where area is missing or the colours are not sure.
        """
        self._time += 1
        own = placement_of(mask, warp)
        if self._lost:  # the course is cut off; the size is not
            self._course.forget()
            self._course.add(self._time, Placement(own.center_px, self._size_px, own.turn), 0.5)
            self._lost = False
        expected = self._course.expected(self._time)
        loss = 1 - (own.size_px / expected.size_px) ** 2
        if sure and loss <= max(LEAST_LOSS, LOSSES * expected.off_size):
            self._waiting.append(self._whole(mask, warp))
            if len(self._waiting) > LEARNT_AFTER:
                self._memory.learn(self._waiting.popleft())
            return "unoccluded", None
        self._waiting.clear()
        return self._with_a_part_missing(mask, warp, own, expected, look())

    def _with_a_part_missing(
        self, mask: Mask, warp: Array, own: Placement, expected: Expected, foreground: Picture
    ) -> tuple[str, Mask | None]:
        shapes = self._memory.shapes
        if shapes is None or shapes.count == 0:
            return self._novel(own, expected)
        signed = 2 * foreground - 1
        found = find(signed, warp, expected, own.turn, shapes, shapes.unlike(self._last))
        seen, sticks_out = self._seen(mask, warp, signed, found)
        if np.count_nonzero(seen) < LEAST_SEEN:
            return self._novel(own, expected)
        said = shapes.in_the_light_of(seen, found.phi, sticks_out, found.weights, found.finalists, True)
        judgement = self._memory.judged(seen, seen, said, LEAST_PIECE).judgement
        if judgement == "novel":
            return self._novel(own, expected)
        if judgement == "unoccluded":
            self._whole(mask, warp)
            return judgement, None
        self._course.add(self._time, found.placement, max(LEAST_WEIGHT, (1 - said.missing) ** 2))
        self._last = np.asarray(found.phi < 0)
        return judgement, put_back(said.completed, warp, found.placement, mask.shape)

    def _seen(self, mask: Mask, warp: Array, signed: Picture, found: Found) -> tuple[Mask, float]:
        """What is seen of the silhouette that was found, in its frame, and by how many pixels more sticks out of it."""
        import cv2

        size = self._memory.options.size
        both = np.dstack([signed, np.abs(signed), mask.astype(np.float32)])
        both = seen_from(both, warp, found.placement, size)
        colors, known = cv2.split(cv2.GaussianBlur(both[..., :2], (0, 0), SMOOTHED_PX * size / FRAME))
        there = (np.asarray(colors) > 0) | ((both[..., 2] > 0.5) & (np.asarray(known) > LEAST_KNOWN))
        phi = found.phi * (FRAME / size)
        beyond = there & (phi > OFF_PX[0]) & (phi < OFF_PX[1])
        return there & (phi < NEAR_PX), float(np.count_nonzero(beyond))

    def _novel(self, own: Placement, expected: Expected) -> tuple[str, None]:
        there = Placement(expected.center_px, expected.size_px, own.turn)
        self._course.add(self._time, there, LEAST_WEIGHT)
        return "novel", None

    def _whole(self, mask: Mask, warp: Array) -> Mask:
        """Take a whole mask into the course; in the memory's frame."""
        place = placement_of(mask, warp)
        self._course.add(self._time, place)
        self._size_px = place.size_px
        self._last = seen_from(mask.astype(np.float32), warp, place, self._memory.options.size) > 0.5
        return self._last
