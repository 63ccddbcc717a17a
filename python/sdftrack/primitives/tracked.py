# SPDX-License-Identifier: MIT
"""What a `Tracker` does about shapes of unknown size: a volume in their place, and a better one now and then."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.shape import FreeSize, Primitive
from sdftrack.results import Status, TrackResult

if TYPE_CHECKING:
    from sdftrack.tracking import Tracker

__all__ = ["FreeSizes"]


class FreeSizes:
    """The primitives among a tracker's shapes, by number.

    Attributes
    ----------
    shapes : Any
        What the tracker was given, with a volume in the place of every primitive.
    """

    def __init__(self, shapes: Any) -> None:
        several = isinstance(shapes, (list, tuple))
        many = list(shapes) if several else [shapes]
        self._free = {k: FreeSize(s) for k, s in enumerate(many) if isinstance(s, Primitive)}
        volumes = [s.placeholder() if isinstance(s, Primitive) else s for s in many]
        self.shapes = volumes if several else volumes[0]

    def fits(self, count: int) -> list[PrimitiveFit | None]:
        """What is known of each of the `count` shapes."""
        return [self._free[k].fit if k in self._free else None for k in range(count)]

    def remove(self, k: int) -> None:
        """Object k is gone; those behind it move up."""
        self._free = {j - (j > k): free for j, free in self._free.items() if j != k}

    def start(self, tracker: Tracker, frame: Frame, camera: Camera, places: list[Any]) -> None:
        """Fit each in its place, which becomes its pose."""
        if not self._free:
            return
        shapes = list(tracker.shapes)
        for k, free in self._free.items():
            fit = free.start(frame, camera, places[k], tracker.threads)
            if fit is None:
                raise ValueError(
                    f"shapes[{k}]: no {free.primitive.kind.replace('auto', 'primitive')} found there; give a mask of "
                    "it, or a frame in which it stands free on the table"
                )
            shapes[k], places[k] = free.volume(), fit.T_cam_obj
        tracker._replace_shapes(shapes, None)

    def look(self, tracker: Tracker, frame: Frame, camera: Camera, result: TrackResult) -> None:
        """After a frame: sizes again, and new volumes where they have changed by more than a voxel."""
        shapes = list(tracker.shapes)
        for k, free in self._free.items():
            if result.status[k] is not Status.OK:
                continue
            volume = free.look(frame, camera, np.ascontiguousarray(result.poses[k]), tracker.threads)
            if volume is not None:
                shapes[k] = volume
        if any(new is not old for new, old in zip(shapes, tracker.shapes, strict=True)):
            tracker._replace_shapes(shapes, result.poses)
