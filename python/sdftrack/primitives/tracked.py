# SPDX-License-Identifier: MIT
"""Handling of shapes of unknown size in a `Tracker`: placeholder volumes, and updates of the size."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import whole
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.shape import FreeSize, Primitive
from sdftrack.results import Status, TrackResult

if TYPE_CHECKING:
    from sdftrack.tracking.interface import TrackerInterface


class FreeSizes:
    """The primitives among a tracker's shapes, by number; `shapes`: all of them, volumes in place of primitives."""

    def __init__(self, shapes: Any) -> None:
        several = isinstance(shapes, (list, tuple))
        many = list(shapes) if several else [shapes]
        self._free = {k: FreeSize(s) for k, s in enumerate(many) if isinstance(s, Primitive)}
        self._missing: dict[int, Any] = {}  # those not found yet, and where the next frame is to show them
        volumes = [s.placeholder() if isinstance(s, Primitive) else s for s in many]
        self.shapes = volumes if several else volumes[0]

    def record(self) -> dict[str, Any]:
        """The state as dictionaries and lists of numbers, text and arrays, for a file."""
        return {
            "found": [[k, free.record()] for k, free in self._free.items()],
            "missing": [[k, place] for k, place in self._missing.items()],
        }

    @staticmethod
    def from_record(record: dict[str, Any], count: int) -> FreeSizes:
        """Restore what `record` returned, of a tracker of `count` shapes, whose volumes it has."""
        out = FreeSizes([])
        out._free = {whole(k, "k", 0, count - 1): FreeSize.from_record(free) for k, free in record["found"]}
        out._missing = {
            whole(k, "k", 0, count - 1): tuple(place) if isinstance(place, list) else place
            for k, place in record["missing"]
        }
        if not out._missing.keys() <= out._free.keys():
            raise ValueError("missing: expected shapes of unknown size, got another one")
        return out

    def copy(self) -> FreeSizes:
        """An independent one in the same state."""
        return FreeSizes.from_record(copy.deepcopy(self.record()), 1 + max(self._free, default=0))

    def __len__(self) -> int:
        return len(self._free)

    def shapes_unknown(self, k: int) -> bool:
        """Whether the size of shape k is not known in advance."""
        return k in self._free

    def fits(self, count: int) -> list[PrimitiveFit | None]:
        """Current estimates for each of the `count` shapes."""
        return [self._free[k].fit if k in self._free else None for k in range(count)]

    def add(self, k: int, shape: Any, place: Any) -> Any:
        """Add a shape, located at `place` in the next frame; returns the shape for the core."""
        if not isinstance(shape, Primitive):
            return shape
        self._free[k], self._missing[k] = FreeSize(shape), place
        return shape.placeholder()

    def remove(self, k: int) -> None:
        """Remove object k; later indices decrease by one."""
        self._free = {j - (j > k): free for j, free in self._free.items() if j != k}
        self._missing = {j - (j > k): place for j, place in self._missing.items() if j != k}

    def look_at(self, k: int, place: Any) -> None:
        """Set the location of object k in the next frame, if it was not found yet."""
        if k in self._missing:
            self._missing[k] = place

    def start(self, tracker: TrackerInterface, frame: Frame, camera: Camera, places: list[Any]) -> None:
        """Fit each primitive at its location, which yields its pose."""
        self._missing = {k: places[k] for k in self._free}
        unknown = np.full((len(places), 4, 4), np.nan)
        for k, pose in self._find(tracker, frame, camera, dict(self._missing), unknown).items():
            places[k] = pose

    def find(
        self, tracker: TrackerInterface, frame: Frame, camera: Camera, anywhere: bool
    ) -> dict[int, NDArray[np.float64]]:
        """Poses of primitives not found before this frame; `anywhere`: also of those without a location."""
        places = {k: place for k, place in self._missing.items() if anywhere or place is not None}
        return self._find(tracker, frame, camera, places, tracker.last_poses)

    def _find(
        self, tracker: TrackerInterface, frame: Frame, camera: Camera, places: dict[int, Any], poses: Any
    ) -> dict[int, NDArray[np.float64]]:
        """Poses of primitives that were found now; the locations of the others applied only to this frame."""
        found: dict[int, NDArray[np.float64]] = {}
        shapes = tracker.shapes
        for k, place in places.items() if frame.depth is not None else ():
            fit = self._free[k].start(frame, camera, place, tracker.threads)
            if fit is None:
                self._missing[k] = None
            else:
                del self._missing[k]
                shapes[k], found[k], poses[k] = self._free[k].volume(), fit.T_cam_obj, fit.T_cam_obj
        self.mark_unfound(tracker)
        if found:
            tracker.replace_shapes(shapes, poses)
        return found

    def mark_unfound(self, tracker: TrackerInterface) -> None:
        """The tracker tracks a placeholder for primitives not found yet; it is reported as lost."""
        for k, free in self._free.items():
            kind = free.primitive.kind.replace("auto", "primitive")
            tracker.mark_unfound(k, kind if free.fit is None else "")

    def look(self, tracker: TrackerInterface, frame: Frame, camera: Camera, result: TrackResult) -> None:
        """Update after a frame: re-estimate sizes, and replace volumes that changed by more than a voxel."""
        shapes, before = tracker.shapes, tracker.shapes
        for k, free in self._free.items():
            if result.status[k] is not Status.OK:
                continue
            volume = free.look(frame, camera, np.ascontiguousarray(result.poses[k]), tracker.threads)
            if volume is not None:
                shapes[k] = volume
        if any(new is not old for new, old in zip(shapes, before, strict=True)):
            tracker.replace_shapes(shapes, result.poses)
