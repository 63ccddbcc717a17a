# SPDX-License-Identifier: MIT
"""Shapes of unknown size for a tracker: estimated at the start, refined during tracking."""

from __future__ import annotations

import copy
from dataclasses import KW_ONLY, asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.saved_file import array_of
from sdftrack._internal.validation import whole
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives.frames import SizeSum
from sdftrack.primitives.result import TABLE, PrimitiveFit, volume_of, with_size
from sdftrack.primitives.segmentation import NEAR_M, ON, SegmentedFrame, distance_to, pieces
from sdftrack.primitives.solver import FitRequest, solve
from sdftrack.results import Status, TrackResult
from sdftrack.sdf import SDF

if TYPE_CHECKING:
    from sdftrack.tracking.interface import TrackerInterface

PLACEHOLDER_M = 0.05  # radius of the ball that stands in until the start
MIN_READINGS = 200
EVERY = 5  # frames between two looks at the size


@dataclass
class Primitive:
    """A primitive of unknown size among the shapes of a `Tracker`.

    At ``start`` it is fitted within the object's mask or box, or to the largest piece on the table; then its distance
    volume is tracked. Its size is re-estimated every few frames, averaged by information (thesis Eq. 3.23), and the
    volume is replaced if it changes by more than a voxel.

    Parameters
    ----------
    kind : {"auto", "sphere", "cylinder", "cone", "box", "ellipsoid", "plane", "superquadric"}
        A plane patch has no inside, so a plate hidden behind it is tracked instead (`PrimitiveFit.plate`).
    voxels : int
        Number of voxels along the longest side of the volume.
    seed : int
        As in `fit_primitive`.

    >>> tracker = st.Tracker(st.Primitive("cylinder"), camera)  # doctest: +SKIP
    >>> result = tracker.start(frame, masks=mask)               # doctest: +SKIP
    >>> tracker.sizes[0]                                        # doctest: +SKIP
    PrimitiveFit(cylinder: radius 33.1 +- 0.1 mm, height 101.7 +- 0.3 mm; rms 1.2 mm, ok)
    """

    kind: str = "auto"
    _: KW_ONLY
    voxels: int = 100
    seed: int = 0

    def __post_init__(self) -> None:
        FitRequest(self.kind, None, self.seed, "exact", 0)
        self.voxels, self.seed = whole(self.voxels, "voxels", 16), int(self.seed)

    def placeholder(self) -> SDF:
        """Placeholder shape before the start."""
        return SDF.sphere(PLACEHOLDER_M, voxels=24)


class FreeSize:
    """Current size estimate of one tracked primitive."""

    def __init__(self, primitive: Primitive) -> None:
        self.primitive = primitive
        self.fit: PrimitiveFit | None = None  # the first fit with the current sizes, once it is found
        self._sum: SizeSum | None = None  # of all looks since the start
        self._shown: NDArray[np.float64] | None = None  # the lengths of the volume that is tracked
        self._voxel_m = 0.0
        self._frames = 0

    def record(self) -> dict[str, Any]:
        """The state as a dictionary of numbers, text and arrays, for a file."""
        return {
            "primitive": asdict(self.primitive),
            "fit": None if self.fit is None else _fit_record(self.fit),
            "sum": None if self._sum is None else self._sum.record(),
            "shown": self._shown,
            "voxel_m": self._voxel_m,
            "frames": self._frames,
        }

    @staticmethod
    def from_record(record: dict[str, Any]) -> FreeSize:
        """Restore what `record` returned."""
        out = FreeSize(Primitive(**record["primitive"]))
        n = 0
        if record["fit"] is not None:
            out.fit = _fit_from(record["fit"])
            n = len(out.fit.size)
        if record["sum"] is not None:
            out._sum = SizeSum.from_record(record["sum"], n)
        if record["shown"] is not None:
            out._shown = array_of(record["shown"], "shown", np.float64, (n,))
        out._voxel_m, out._frames = float(record["voxel_m"]), int(record["frames"])
        return out

    def start(self, frame: Frame, camera: Camera, place: Any, threads: int) -> PrimitiveFit | None:
        """Fit in a mask (bool), a box (x, y, w, h) or, with None, the largest piece; None: nothing was found."""
        self.fit, self._sum, self._frames = None, None, 0
        if frame.depth is None:
            return None
        mask = _mask_of(place, frame.depth.shape)
        if mask is not None and not (frame.depth[mask] > 0).any():
            return None
        seen = SegmentedFrame.of(frame, camera, "auto", mask)
        found = _at(pieces(seen, mask), place, camera)
        if not found:
            return None
        request = FitRequest(self.primitive.kind, None, self.primitive.seed, "exact", threads)
        labels = seen.labels(found[0], True)
        if np.count_nonzero(labels == ON) < max(MIN_READINGS, request.min_points()):
            return None
        fit = solve(seen.view(labels), request)
        if fit.status is Status.LOST:
            return None
        self.fit = fit
        self._note(fit)
        return fit

    def look(self, frame: Frame, camera: Camera, T_cam_obj: NDArray[np.float64], threads: int) -> SDF | None:
        """Re-estimate the size at a tracked pose; returns a new volume if it changed by more than a voxel."""
        self._frames += 1
        if self.fit is None or frame.depth is None or self._frames % EVERY:
            return None
        seen = SegmentedFrame.of(frame, camera, "auto", None)
        away = distance_to(seen, self.fit.kind, list(self.fit.size.values()), T_cam_obj)
        labels = seen.labels(away < NEAR_M, True)
        if np.count_nonzero(labels == ON) < MIN_READINGS:
            return None
        request = FitRequest(self.fit.kind, (T_cam_obj, self.fit.size), self.primitive.seed, "exact", threads)
        fit = solve(seen.view(labels), request)
        if fit.status is Status.LOST or not self._plausible(fit):
            return None
        self._note(fit)
        size, is_length = np.array(list(self.fit.size.values())), TABLE[self.fit.kind].is_length
        # An exponent moves the surface by at most half of log 2 of a half axis (docs/math/primitives.md, section 9).
        reach = np.where(is_length, 1.0, 0.35 * size[is_length].max())
        if self._shown is not None and (reach * np.abs(size - self._shown)).max() <= self._voxel_m:
            return None
        return self.volume()

    def volume(self) -> SDF:
        """Volume of the current size."""
        assert self.fit is not None
        out = volume_of(self.fit.kind, self.fit.size, self.primitive.voxels)
        self._shown, self._voxel_m = np.array(list(self.fit.size.values())), out.voxel_size
        return out

    def _plausible(self, fit: PrimitiveFit) -> bool:
        """Reject implausible sizes: a hand over the object makes it appear smaller or larger."""
        assert self.fit is not None
        bounded = np.array(list(self.fit.bounded.values())) & TABLE[self.fit.kind].is_length
        ratio = np.array(list(fit.size.values())) / np.array(list(self.fit.size.values()))
        return bool((np.abs(np.log(ratio[bounded])) < np.log(1.5)).all()) and fit.inliers > 0.6

    def _note(self, fit: PrimitiveFit) -> None:
        if self._sum is None:
            self._sum = SizeSum(len(fit.size))
        self._sum.add(np.array(list(fit.size.values())), fit.covariance[6:, 6:])
        scores = fit.scores if self.fit is None else self.fit.scores
        self.fit = replace(with_size(fit, *self._sum.mean()), scores=scores)


def _fit_record(fit: PrimitiveFit) -> dict[str, Any]:
    return {f.name: getattr(fit, f.name) for f in fields(fit) if f.name not in ("per_frame", "skipped")}


def _fit_from(record: dict[str, Any]) -> PrimitiveFit:
    fit = PrimitiveFit(**{**record, "status": Status(record["status"])})
    if tuple(fit.size) != tuple(TABLE[fit.kind].sizes):
        raise ValueError(f"size: expected {TABLE[fit.kind].sizes}, got {tuple(fit.size)}")
    n = 6 + len(fit.size)
    array_of(fit.T_cam_obj, "T_cam_obj", np.float64, (4, 4))
    array_of(fit.covariance, "covariance", np.float64, (n, n))
    return fit


def _mask_of(place: Any, shape: tuple[int, int]) -> NDArray[np.bool_] | None:
    if place is None or np.shape(place) == (4, 4):
        return None
    given = np.asarray(place)
    if given.shape == shape:
        out: NDArray[np.bool_] = given != 0
        return out
    x, y, w, h = (round(float(v)) for v in given)
    inside = np.zeros(shape, bool)
    inside[max(0, y) : max(0, y + h), max(0, x) : max(0, x + w)] = True
    return inside


def _at(found: list[NDArray[np.bool_]], place: Any, camera: Camera) -> list[NDArray[np.bool_]]:
    """For a pose, the pieces that contain the projection of its origin."""
    if np.shape(place) != (4, 4):
        return found
    x, y = (round(float(v)) for v in camera.project(np.asarray(place)[None, :3, 3])[0])
    inside = 0 <= x < camera.width and 0 <= y < camera.height
    return [p for p in found if inside and p[y, x]]


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
