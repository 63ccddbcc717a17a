# SPDX-License-Identifier: MIT
"""Detects and fills in occlusions for a contour tracker (thesis 6.3.4; docs/shape_memory.md, "In a video").

An occluder takes area away from one side, and the tracker's grid moves and shrinks with the visible rest. Each frame is
therefore compared with the place and size predicted from the frames before. Where area is suddenly missing, the
silhouettes of the memory are matched to the colours of the image around the predicted place; the best one shows what is
hidden. A silhouette that was visible as a whole is learned some frames later, unless an occlusion follows.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.alignment import FRAME, Found, find
from sdftrack.contour.memory import ShapeMemory
from sdftrack.contour.placement import (
    MotionPredictor,
    Placement,
    Prediction,
    placement_of,
    put_back,
    seen_from,
)

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Picture: TypeAlias = NDArray[np.float32]

MIN_LOSS = 0.05  # share of the area that must be missing suddenly for an occlusion to be considered
LOSS_ERRORS = 5.0  # the same in rms errors of the predicted size
LEARNT_AFTER = 10  # frames that a silhouette waits: one that an occluder begins to cover is not learned
NEAR_PX = (
    2.5  # of a 64 x 64 frame: pixels of the object's colours so near to the expected silhouette are its own
)
OFF_PX = (1.5, 8.0)  # distances at which pixels of the object's colours lie beyond the expected silhouette
SMOOTHED_PX = 1.0  # of the posterior, before it is cut at one half
MIN_KNOWN = 0.2  # mean |2 p - 1| around a pixel; where it is less, the colours are of neither side
MIN_SEEN = 12  # pixels of the frame; fewer say nothing
MIN_PIECE = 0.25  # of the largest hidden piece: smaller ones are limbs in another pose, not further occluders
MIN_WEIGHT = 0.02  # of a frame with nearly everything hidden, in the motion prediction


class OcclusionHandler:
    """Judges each frame's mask with a shape memory, for `ContourTracker`.

    Parameters
    ----------
    memory : ShapeMemory
        With ``rule="remembered"``.
    """

    def __init__(self, memory: ShapeMemory) -> None:
        self._memory = memory

    def begin(self, mask: Mask, warp: Array) -> None:
        """Start with the unoccluded mask (ny, nx) of the first frame; `warp` (3, 3) maps its grid to the image."""
        self._time, self._lost = 0, False
        self._motion = MotionPredictor()
        self._waiting: deque[Mask] = deque()
        self._size_px = 0.0
        self._last: Mask = self._whole(mask, warp)

    def learn(self, mask: Mask, warp: Array) -> None:
        """Learn a mask that is known to be unoccluded (burn-in)."""
        self._time += 1
        self._lost = False
        self._memory.learn(self._whole(mask, warp))

    def mark_lost(self) -> None:
        """A frame without a mask."""
        self._time += 1
        self._lost = True
        self._waiting.clear()

    def judge(
        self, mask: Mask, warp: Array, sure: bool, look: Callable[[], Picture]
    ) -> tuple[str, Mask | None]:
        """The judgement, and the recovered silhouette on the grid if it is "occluded".

        `sure`: the colours on both sides of the outline match those at the start; otherwise nothing is learned.
        `look()` returns the posterior (ny, nx) float32 of the object's colours at every cell; it is called only if area
        is missing or the colours are uncertain.
        """
        self._time += 1
        own = placement_of(mask, warp)
        if self._lost:  # the motion starts again, the size does not
            self._motion.forget()
            self._motion.add(self._time, Placement(own.center_px, self._size_px, own.turn), 0.5)
            self._lost = False
        predicted = self._motion.predict(self._time)
        loss = 1 - (own.size_px / predicted.size_px) ** 2
        if sure and loss <= max(MIN_LOSS, LOSS_ERRORS * predicted.size_error):
            self._waiting.append(self._whole(mask, warp))
            if len(self._waiting) > LEARNT_AFTER:
                self._memory.learn(self._waiting.popleft())
            return "unoccluded", None
        self._waiting.clear()
        return self._handle_missing_area(mask, warp, own, predicted, look())

    def _handle_missing_area(
        self, mask: Mask, warp: Array, own: Placement, predicted: Prediction, foreground: Picture
    ) -> tuple[str, Mask | None]:
        shapes = self._memory.shapes
        if shapes is None or shapes.count == 0:
            return self._novel(own, predicted)
        signed = 2 * foreground - 1
        found = find(signed, warp, predicted, own.turn, shapes, shapes.dissimilarity(self._last))
        seen, beyond_px = self._seen(mask, warp, signed, found)
        if np.count_nonzero(seen) < MIN_SEEN:
            return self._novel(own, predicted)
        said = shapes.explain_by(seen, found.phi, beyond_px, found.weights, found.finalists, True)
        judgement = self._memory.judged(seen, seen, said, MIN_PIECE).judgement
        if judgement == "novel":
            return self._novel(own, predicted)
        if judgement == "unoccluded":
            self._whole(mask, warp)
            return judgement, None
        self._motion.add(self._time, found.placement, max(MIN_WEIGHT, (1 - said.missing) ** 2))
        self._last = np.asarray(found.phi < 0)
        return judgement, put_back(said.completed, warp, found.placement, mask.shape)

    def _seen(self, mask: Mask, warp: Array, signed: Picture, found: Found) -> tuple[Mask, float]:
        """The visible part of the silhouette found, in its frame, and the number of pixels of its colours beyond it."""
        import cv2

        size = self._memory.options.size
        both = np.dstack([signed, np.abs(signed), mask.astype(np.float32)])
        both = seen_from(both, warp, found.placement, size)
        colors, known = cv2.split(cv2.GaussianBlur(both[..., :2], (0, 0), SMOOTHED_PX * size / FRAME))
        there = (np.asarray(colors) > 0) | ((both[..., 2] > 0.5) & (np.asarray(known) > MIN_KNOWN))
        phi = found.phi * (FRAME / size)
        beyond = there & (phi > OFF_PX[0]) & (phi < OFF_PX[1])
        return there & (phi < NEAR_PX), float(np.count_nonzero(beyond))

    def _novel(self, own: Placement, predicted: Prediction) -> tuple[str, None]:
        there = Placement(predicted.center_px, predicted.size_px, own.turn)
        self._motion.add(self._time, there, MIN_WEIGHT)
        return "novel", None

    def _whole(self, mask: Mask, warp: Array) -> Mask:
        """Add a whole mask to the motion; returns it in the memory's frame."""
        place = placement_of(mask, warp)
        self._motion.add(self._time, place)
        self._size_px = place.size_px
        self._last = seen_from(mask.astype(np.float32), warp, place, self._memory.options.size) > 0.5
        return self._last
