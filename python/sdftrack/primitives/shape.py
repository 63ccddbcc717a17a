# SPDX-License-Identifier: MIT
"""A shape of unknown size for the tracker: estimated at the start, refined during tracking."""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.saved_file import array_of
from sdftrack._internal.validation import whole
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives.kinds import TABLE
from sdftrack.primitives.multi_frame import SizeSum
from sdftrack.primitives.result import PrimitiveFit, volume_of
from sdftrack.primitives.segmentation import NEAR_M, ON, SegmentedFrame, distance_to, pieces
from sdftrack.primitives.solver import FitRequest, solve
from sdftrack.results import Status
from sdftrack.sdf import SDF

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
    kind : {"auto", "sphere", "cylinder", "cone", "box", "ellipsoid", "plane"}
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
        size = np.array(list(self.fit.size.values()))
        if self._shown is not None and np.abs(size - self._shown).max() <= self._voxel_m:
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
        bounded = np.array(list(self.fit.bounded.values()))
        ratio = np.array(list(fit.size.values())) / np.array(list(self.fit.size.values()))
        return bool((np.abs(np.log(ratio[bounded])) < np.log(1.5)).all()) and fit.inliers > 0.6

    def _note(self, fit: PrimitiveFit) -> None:
        if self._sum is None:
            self._sum = SizeSum(len(fit.size))
        self._sum.add(np.array(list(fit.size.values())), fit.covariance[6:, 6:])
        size, covariance = self._sum.mean()
        whole = fit.covariance.copy()
        whole[6:, :] = whole[:, 6:] = 0
        whole[6:, 6:] = covariance
        lengths = dict(zip(fit.size, size.tolist(), strict=True))
        scores = fit.scores if self.fit is None else self.fit.scores
        self.fit = replace(fit, size=lengths, covariance=whole, scores=scores)


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
