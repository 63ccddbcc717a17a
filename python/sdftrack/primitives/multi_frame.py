# SPDX-License-Identifier: MIT
"""Size estimation from several frames."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.saved_file import array_of
from sdftrack.frame import Frame
from sdftrack.primitives.in_frame import FrameFitter
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.solver import FitRequest, unbounded
from sdftrack.results import Status

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
        if found.bounded[name] and bounded[at] and ratio > np.log(MAX_RATIO):
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
    whole = last.covariance.copy()
    whole[6:, :] = whole[:, 6:] = 0
    whole[6:, 6:] = covariance
    loose = [name for name, held in last.bounded.items() if not held]
    status, reason = last.status, last.reason
    if np.isfinite(np.diag(covariance)).all() and reason == unbounded(loose):
        status, reason = Status.OK, ""
    return replace(
        last,
        size=dict(zip(last.size, size.tolist(), strict=True)),
        covariance=whole,
        status=status,
        reason=reason,
        scores=fits[0].scores,
        per_frame=tuple(fits),
    )
