# SPDX-License-Identifier: MIT
"""Fit a primitive to one frame."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.frame import Frame
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.segmentation import ON, SegmentedFrame, camera_of, checked_mask, mask_near, pieces
from sdftrack.primitives.solver import FitRequest, solve


class FrameFitter:
    """Fits to frames with one camera (None: each frame's own) and one setting for the table."""

    def __init__(self, camera: Any, plane: Any) -> None:
        self.camera, self.plane = camera, plane

    def fit(self, frame: Frame, mask: Any, request: FitRequest) -> PrimitiveFit:
        """Fit in the mask; without one, in the frame's own mask, at the start, or in the largest piece on the table."""
        seen, given = self._seen(frame, mask)
        if given is not None:
            return _solved(seen, given, False, request)
        if request.pose is not None and request.size is not None:
            near = mask_near(seen, request.kinds[0], request.size, request.pose)
            if near is None:
                raise ValueError(
                    "initial: expected a pose at something that stands off the dominant plane, got one with nothing "
                    "within its own size; pass a mask, or plane=None where there is no table"
                )
            return _solved(seen, near[0], True, request)
        found = pieces(seen)
        if not found:
            raise ValueError(
                "frame: expected something that stands off the dominant plane, got nothing; pass a mask, or "
                "plane=None where there is no table"
            )
        return _solved(seen, found[0], True, request)

    def again(self, frame: Frame, request: FitRequest) -> Iterator[PrimitiveFit]:
        """Candidate fits in a later frame, starting from `request`; iterate until one is acceptable.

        First from the previous pose; then from guesses in the same piece, for larger motion.
        """
        seen, given = self._seen(frame, None)
        assert request.size is not None
        assert request.pose is not None
        fresh = copy.copy(request)
        fresh.pose = fresh.size = None
        if given is not None:
            yield _solved(seen, given, False, request)
            yield _solved(seen, given, False, fresh)
            return
        near = mask_near(seen, request.kinds[0], request.size, request.pose)
        if near is None:
            raise ValueError(
                "there is nothing within the object's size of its location in the previous frame"
            )
        yield _solved(seen, near[0], True, request)
        yield _solved(seen, near[1], True, fresh)

    def _seen(self, frame: Frame, mask: Any) -> tuple[SegmentedFrame, NDArray[np.bool_] | None]:
        pinhole = camera_of(frame, self.camera)
        given = checked_mask(mask, frame)
        return SegmentedFrame.of(frame, pinhole, self.plane, given), given


def _solved(
    seen: SegmentedFrame, own: NDArray[np.bool_], own_foot: bool, request: FitRequest
) -> PrimitiveFit:
    labels = seen.labels(own, own_foot)
    count = int(np.count_nonzero(labels == ON))
    if count < request.min_points():
        off = "" if seen.plane is None else " off the table"
        raise ValueError(
            f"mask: expected at least {request.min_points()} depth measurements{off} in it (the number of unknowns), "
            f"got {count}"
        )
    return solve(seen.view(labels), request)
