# SPDX-License-Identifier: MIT
"""What a `Tracker` does about shapes of unknown size: a volume in their place, and a better one now and then."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.shape import FreeSize, Primitive
from sdftrack.results import Status, TrackResult

if TYPE_CHECKING:
    from sdftrack.tracking.interface import TrackerInterface

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
        self._missing: dict[int, Any] = {}  # those not found yet, and where the next frame is to show them
        volumes = [s.placeholder() if isinstance(s, Primitive) else s for s in many]
        self.shapes = volumes if several else volumes[0]

    def __len__(self) -> int:
        return len(self._free)

    def shapes_unknown(self, k: int) -> bool:
        """Whether the size of shape k is not known beforehand."""
        return k in self._free

    def fits(self, count: int) -> list[PrimitiveFit | None]:
        """What is known of each of the `count` shapes."""
        return [self._free[k].fit if k in self._free else None for k in range(count)]

    def add(self, k: int, shape: Any, place: Any) -> Any:
        """One more shape, in `place` in the next frame; what the core is to be given."""
        if not isinstance(shape, Primitive):
            return shape
        self._free[k], self._missing[k] = FreeSize(shape), place
        return shape.placeholder()

    def remove(self, k: int) -> None:
        """Object k is gone; those behind it move up."""
        self._free = {j - (j > k): free for j, free in self._free.items() if j != k}
        self._missing = {j - (j > k): place for j, place in self._missing.items() if j != k}

    def look_at(self, k: int, place: Any) -> None:
        """Where the next frame shows object k, if it was not found yet."""
        if k in self._missing:
            self._missing[k] = place

    def start(self, tracker: TrackerInterface, frame: Frame, camera: Camera, places: list[Any]) -> None:
        """Fit each in its place, which becomes its pose."""
        self._missing = {k: places[k] for k in self._free}
        found = self._found(frame, camera, tracker.threads, dict(self._missing))
        self.mark_unfound(tracker)
        if not found:
            return
        shapes = tracker.shapes
        for k, fit in found.items():
            shapes[k], places[k] = self._free[k].volume(), fit.T_cam_obj
        tracker.replace_shapes(shapes, np.full((len(shapes), 4, 4), np.nan))

    def find(
        self, tracker: TrackerInterface, frame: Frame, camera: Camera, anywhere: bool
    ) -> dict[int, NDArray[np.float64]]:
        """Poses of those not found before this frame; `anywhere`: also of those without a place."""
        places = {k: place for k, place in self._missing.items() if anywhere or place is not None}
        found = self._found(frame, camera, tracker.threads, places)
        self.mark_unfound(tracker)
        if found:
            shapes, poses = tracker.shapes, tracker.last_poses
            for k, fit in found.items():
                shapes[k], poses[k] = self._free[k].volume(), fit.T_cam_obj
            tracker.replace_shapes(shapes, poses)
        return {k: fit.T_cam_obj for k, fit in found.items()}

    def _found(
        self, frame: Frame, camera: Camera, threads: int, places: dict[int, Any]
    ) -> dict[int, PrimitiveFit]:
        """Fits of those that are there, missing no longer; the places of others were this frame's alone."""
        found: dict[int, PrimitiveFit] = {}
        if frame.depth is None:
            return found
        for k, place in places.items():
            fit = self._free[k].start(frame, camera, place, threads)
            if fit is None:
                self._missing[k] = None
            else:
                del self._missing[k]
                found[k] = fit
        return found

    def mark_unfound(self, tracker: TrackerInterface) -> None:
        """Of those not found yet the tracker follows a placeholder, which it reports as lost."""
        for k, free in self._free.items():
            kind = free.primitive.kind.replace("auto", "primitive")
            tracker.mark_unfound(k, kind if free.fit is None else "")

    def look(self, tracker: TrackerInterface, frame: Frame, camera: Camera, result: TrackResult) -> None:
        """After a frame: sizes again, and new volumes where they have changed by more than a voxel."""
        shapes, before = tracker.shapes, tracker.shapes
        for k, free in self._free.items():
            if result.status[k] is not Status.OK:
                continue
            volume = free.look(frame, camera, np.ascontiguousarray(result.poses[k]), tracker.threads)
            if volume is not None:
                shapes[k] = volume
        if any(new is not old for new, old in zip(shapes, before, strict=True)):
            tracker.replace_shapes(shapes, result.poses)
