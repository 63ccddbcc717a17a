# SPDX-License-Identifier: MIT
"""Fit primitives to frames: to one, to several of one object, or one after the other to all on a table."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.saved_file import array_of
from sdftrack._internal.validation import of_kind, whole
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.primitives.result import TABLE, PrimitiveFit, with_size
from sdftrack.primitives.segmentation import (
    ON,
    SegmentedFrame,
    camera_of,
    checked_mask,
    checked_plane,
    distance_to,
    mask_near,
    pieces,
)
from sdftrack.primitives.solver import FitRequest, solve, unbounded
from sdftrack.results import Status


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
        """Candidate fits in a later frame, starting from `request`; iterate until one is acceptable."""
        # First from the previous pose; then from guesses in the same piece, for larger motion.
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


CLAIM_M = 0.008  # measurements so near a fitted surface, at up to 1 m, are that object's
MIN_READINGS = 150


def fit_primitives(
    frame: Frame,
    kind: str = "auto",
    *,
    camera: Camera | RGBDCamera | None = None,
    mask: ArrayLike | None = None,
    most: int = 20,
    seed: int = 0,
    scaling: str = "exact",
    plane: Any = "auto",
    threads: int = 0,
) -> list[PrimitiveFit]:
    """Fit primitives sequentially: each removes the measurements on its surface, the next is fitted to the rest.

    Parameters
    ----------
    frame : Frame
        With a depth image.
    kind, camera, seed, scaling, plane, threads
        As in `fit_primitive`.
    mask : (H, W) bool or uint8, optional
        Search region; None: everything above the table.
    most : int
        Maximum number of objects.

    Returns
    -------
    list of PrimitiveFit
        In order of decreasing piece size. Pieces that no primitive explains (status ``"lost"``) are omitted.

    >>> for fit in st.fit_primitives(frame, camera=camera): print(fit)  # doctest: +SKIP
    """
    request = FitRequest(kind, None, seed, scaling, threads)
    most = whole(most, "most", 1, what="a number of objects, at least 1")
    of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
    pinhole = camera_of(frame, camera)
    given = checked_mask(mask, frame) if mask is not None else None
    seen = SegmentedFrame.of(frame, pinhole, checked_plane(plane), None)
    rest = np.ones(seen.depth.shape, bool) if given is None else given.copy()
    out: list[PrimitiveFit] = []
    while len(out) < most:
        found = [p for p in pieces(seen, rest) if np.count_nonzero(p) >= MIN_READINGS]
        if not found:
            return out
        piece = found[0]
        labels = seen.labels(piece, True)
        if np.count_nonzero(labels == ON) < request.min_points():
            rest &= ~piece
            continue
        fit = solve(seen.view(labels), request)
        lengths = list(fit.size.values())
        claimed = piece & (distance_to(seen, fit.kind, lengths, fit.T_cam_obj) < CLAIM_M)
        if fit.status is Status.LOST or np.count_nonzero(claimed) < MIN_READINGS:
            rest &= ~piece
            continue
        out.append(fit)
        # What is left of a piece that the primitive explains is its rim; else there is another object.
        rest &= ~(piece if fit.inliers > 0.8 else claimed)
    return out


GATE = 4.0  # standard deviations: a frame whose size is farther from the others' has seen something else
MIN_INLIERS = 0.6  # of a later frame; of an object whose first frame has fewer, nearly as many
MIN_SHARE_OF_FIRST = 0.8
MAX_RATIO = 1.5  # of a bounded length to those before: half as large again is another thing
MIN_M2, MIN_SHARE = 1e-18, 1e-9  # of a variance that is inverted: a nanometre, and rounding
FLOOR_M = 2e-4  # of the spread between frames: a length that is seen as well as that is no outlier


class SizeSum:
    """Recursive information-weighted mean of sizes (n,), m (thesis Eq. 3.23)."""

    def __init__(self, n: int) -> None:
        self._information, self._weighted = np.zeros((n, n)), np.zeros(n)
        self._largest = np.zeros(n)

    def record(self) -> dict[str, Any]:
        """The sums, for a file."""
        return {"information": self._information, "weighted": self._weighted, "largest": self._largest}

    @staticmethod
    def from_record(record: dict[str, Any], n: int) -> SizeSum:
        """Restore what `record` returned, of n lengths."""
        out = SizeSum(n)
        out._information = array_of(record["information"], "information", np.float64, (n, n))
        out._weighted = array_of(record["weighted"], "weighted", np.float64, (n,))
        out._largest = array_of(record["largest"], "largest", np.float64, (n,))
        return out

    def add(self, size: NDArray[np.float64], covariance: NDArray[np.float64]) -> None:
        """Add a size with its covariance (n, n), m^2; lengths with infinite variance are ignored."""
        self._largest = np.maximum(self._largest, size)
        held = np.flatnonzero(np.isfinite(np.diag(covariance)))
        if not len(held):
            return
        at = np.ix_(held, held)
        own = _inverse(covariance[at])
        self._information[at] += own
        self._weighted[held] += own @ size[held]

    def mean(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Size and covariance; a length never bounded is the maximum of all, because each is a lower bound."""
        n = len(self._weighted)
        known = np.flatnonzero(np.diag(self._information) > 0)
        out, covariance = self._largest.copy(), np.zeros((n, n))
        covariance[np.diag_indices(n)] = np.inf
        if len(known):
            at = np.ix_(known, known)
            covariance[at] = _inverse(self._information[at])
            out[known] = covariance[at] @ self._weighted[known]
        return out, covariance


def _inverse(a: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric matrix that may be singular: exact measurements have no variance."""
    values, vectors = np.linalg.eigh(a)
    safe = np.maximum(values, max(MIN_M2, MIN_SHARE * float(values[-1])))
    out: NDArray[np.float64] = (vectors / safe) @ vectors.T
    return out


def fuse_sizes(
    sizes: NDArray[np.float64], covariances: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Information-weighted mean of sizes (F, n), m, with covariances (F, n, n), m^2, as of `SizeSum`.

    >>> fuse_sizes(np.array([[0.1], [0.2]]), np.array([[[1.0]], [[np.inf]]]))[0]
    array([0.1])
    """
    total = SizeSum(sizes.shape[1])
    for size, covariance in zip(sizes, covariances, strict=True):
        total.add(size, covariance)
    return total.mean()


def fused(frames: Iterable[Any], request: FitRequest, mask: Any, fitter: FrameFitter) -> PrimitiveFit:
    """Fit each frame starting from the last fitted one; returns one size for all, and the pose in the last one."""
    fits: dict[int, PrimitiveFit] = {}
    skipped: dict[int, str] = {}
    lost: PrimitiveFit | None = None
    for i, frame in enumerate(frames):
        if not isinstance(frame, Frame):
            raise TypeError(f"frames: expected st.Frame, got {type(frame).__name__} at {i}")
        try:
            found = _follow(frame, request, fitter, fits) if fits else fitter.fit(frame, mask, request)
        except ValueError as error:
            skipped[i] = str(error)
            continue
        if found.status is Status.LOST:
            skipped[i] = found.reason
            lost = lost or found
            continue
        fits[i] = found
    if not fits and lost is not None:
        return replace(lost, per_frame=(lost,), skipped=skipped)
    if not fits:
        raise ValueError(_none_of(skipped))
    odd = _odd_ones(fits)
    sure = [f for i, f in fits.items() if i not in odd]
    skipped = dict(sorted({**skipped, **odd}.items()))
    if len(sure) == 1:
        return replace(sure[0], per_frame=(sure[0],), skipped=skipped)
    size, covariance = fuse_sizes(_sizes(sure), np.stack([f.covariance[6:, 6:] for f in sure]))
    return replace(_with_size(sure, size, covariance), skipped=skipped)


def _follow(
    frame: Frame, request: FitRequest, fitter: FrameFitter, fits: dict[int, PrimitiveFit]
) -> PrimitiveFit:
    """Fit the object of `fits` in one more frame; ValueError if another object is found."""
    known = list(fits.values())
    now = copy.copy(request)
    now.kinds = (known[0].kind,)
    now.pose, now.size = known[-1].T_cam_obj, list(known[-1].size.values())
    why = ""
    for found in fitter.again(frame, now):
        other = _another(found, known)
        if not other:
            return found
        why = why or other
    raise ValueError(why)


def _another(found: PrimitiveFit, known: list[PrimitiveFit]) -> str:
    """Reason why a fit is not of the known object; "" if it may be."""
    least = min(MIN_INLIERS, MIN_SHARE_OF_FIRST * known[0].inliers)
    if found.inliers < least:
        return f"only {100 * found.inliers:.0f} % of the depth measurements are on its surface"
    middle = np.median(_sizes(known), axis=0)
    bounded = [any(f.bounded[name] for f in known) for name in found.size]
    for at, (name, length) in enumerate(found.size.items()):
        ratio = abs(np.log(length / middle[at]))
        known_length = found.bounded[name] and bounded[at] and TABLE[found.kind].is_length[at]
        if known_length and ratio > np.log(MAX_RATIO):
            return (
                f"another object: a {name} of {1e3 * length:.1f} mm where the previous frames have "
                f"{1e3 * middle[at]:.1f} mm"
            )
    return ""


def _none_of(skipped: dict[int, str]) -> str:
    if not skipped:
        return "frames: expected at least one with a depth image, got none"
    first = next(iter(skipped))
    return (
        f"frames: expected at least one that a primitive can be fitted to, got none of {len(skipped)}; frame {first}: "
        f"{skipped[first]}"
    )


def _sizes(fits: list[PrimitiveFit]) -> NDArray[np.float64]:
    return np.array([list(f.size.values()) for f in fits])


def _odd_ones(fits: dict[int, PrimitiveFit]) -> dict[int, str]:
    """Fits whose size is far from the median, relative to their deviation and the spread, with the reason."""
    sizes = _sizes(list(fits.values()))
    middle = np.median(sizes, axis=0)
    spread = 1.4826 * np.median(np.abs(sizes - middle), axis=0) + FLOOR_M
    sd = np.sqrt(np.array([np.diag(f.covariance)[6:] for f in fits.values()]))
    far: NDArray[np.bool_] = np.abs(sizes - middle) >= GATE * (spread + np.where(np.isfinite(sd), sd, np.inf))
    far &= TABLE[next(iter(fits.values())).kind].is_length
    if far.any(axis=1).all():
        return {}
    out: dict[int, str] = {}
    for (i, fit), of_fit, size in zip(fits.items(), far, sizes, strict=True):
        for name, is_far, length, most in zip(fit.size, of_fit, size, middle, strict=True):
            if is_far:
                out[i] = f"its {name} of {1e3 * length:.1f} mm is far from the others' {1e3 * most:.1f} mm"
    return out


def _with_size(
    fits: list[PrimitiveFit], size: NDArray[np.float64], covariance: NDArray[np.float64]
) -> PrimitiveFit:
    last = fits[-1]
    loose = [name for name, held in last.bounded.items() if not held]
    status, reason = last.status, last.reason
    if np.isfinite(np.diag(covariance)).all() and reason == unbounded(loose):
        status, reason = Status.OK, ""
    found = with_size(last, size, covariance)
    return replace(found, status=status, reason=reason, scores=fits[0].scores, per_frame=tuple(fits))
