# SPDX-License-Identifier: MIT
"""One size from many frames."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.frame import Frame
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.solving import Wish
from sdftrack.results import Status

__all__ = ["fuse_sizes", "fused"]

GATE = 4.0  # standard deviations: a frame whose size is farther from the others' has seen something else
FLOOR_M = 2e-4  # of the spread between frames: a length that is seen as well as that is no outlier


def fuse_sizes(
    sizes: NDArray[np.float64], covariances: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Information-weighted mean (thesis Eq. 3.23) of sizes (F, n), m, with covariances (F, n, n), m^2.

    A length with an infinite variance in a frame has no say from there; one that is infinite in all of them stays so,
    at the largest value, for each is the least that holds what one frame saw.

    >>> fuse_sizes(np.array([[0.1], [0.2]]), np.array([[[1.0]], [[np.inf]]]))[0]
    array([0.1])
    """
    n = sizes.shape[1]
    information, weighted = np.zeros((n, n)), np.zeros(n)
    for size, covariance in zip(sizes, covariances, strict=True):
        held = np.flatnonzero(np.isfinite(np.diag(covariance)))
        if not len(held):
            continue
        at = np.ix_(held, held)
        own = np.linalg.inv(covariance[at])
        information[at] += own
        weighted[held] += own @ size[held]
    known = np.flatnonzero(np.diag(information) > 0)
    out, covariance = sizes.max(axis=0), np.zeros((n, n))
    covariance[np.diag_indices(n)] = np.inf
    if len(known):
        at = np.ix_(known, known)
        covariance[at] = np.linalg.inv(information[at])
        out[known] = covariance[at] @ weighted[known]
    return out, covariance


def fused(
    frames: Iterable[Any], wish: Wish, mask: Any, fit: Callable[[Frame, Any, Wish], PrimitiveFit]
) -> PrimitiveFit:
    """Each frame from the one before, then one size for all, and the last frame's pose."""
    fits: list[PrimitiveFit] = []
    last: Frame | None = None
    for i, frame in enumerate(frames):
        if not isinstance(frame, Frame):
            raise TypeError(f"frames: expected st.Frame, got {type(frame).__name__} at {i}")
        if frame.error or frame.depth is None:
            continue
        now = wish
        if fits:
            now = copy.copy(wish)
            now.kinds = (fits[0].kind,)
            now.pose, now.size = fits[-1].T_cam_obj, list(fits[-1].size.values())
        given = mask if not fits else None
        fits.append(fit(frame, given, now))
        last = frame
    if not fits or last is None:
        raise ValueError("frames: expected at least one with a depth image, got none")
    if len(fits) == 1:
        return replace(fits[0], per_frame=(fits[0],))
    sure = _agreeing([f for f in fits if f.status is not Status.LOST] or fits)
    sizes = np.array([list(f.size.values()) for f in sure])
    size, covariance = fuse_sizes(sizes, np.stack([f.covariance[6:, 6:] for f in sure]))
    return _with_size(fits, size, covariance)


def _agreeing(fits: list[PrimitiveFit]) -> list[PrimitiveFit]:
    """Without those whose size is far from the median's, by their own deviation and the others' spread."""
    sizes = np.array([list(f.size.values()) for f in fits])
    middle = np.median(sizes, axis=0)
    spread = 1.4826 * np.median(np.abs(sizes - middle), axis=0) + FLOOR_M
    sd = np.sqrt(np.array([np.diag(f.covariance)[6:] for f in fits]))
    near = (np.abs(sizes - middle) < GATE * (spread + np.where(np.isfinite(sd), sd, np.inf))).all(axis=1)
    return [f for f, good in zip(fits, near, strict=True) if good] or fits


def _with_size(
    fits: list[PrimitiveFit], size: NDArray[np.float64], covariance: NDArray[np.float64]
) -> PrimitiveFit:
    last = fits[-1]
    whole = last.covariance.copy()
    whole[6:, :] = whole[:, 6:] = 0
    whole[6:, 6:] = covariance
    names = list(last.size)
    loose = [name for name, v in zip(names, np.diag(covariance), strict=True) if not np.isfinite(v)]
    status, reason = last.status, last.reason
    if status is Status.WEAK and not loose and "bounds" in reason:
        status, reason = Status.OK, ""
    return replace(
        last,
        size=dict(zip(names, size.tolist(), strict=True)),
        covariance=whole,
        status=status,
        reason=reason,
        scores=fits[0].scores,
        per_frame=tuple(fits),
    )
