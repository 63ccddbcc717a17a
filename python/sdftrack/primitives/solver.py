# SPDX-License-Identifier: MIT
"""Calls the core's solver and converts its result to lengths, variances and scores."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.validation import THREADS, number, of_kind, one_of, whole
from sdftrack.primitives.result import FREE, KINDS, SIZES, SOLIDS, TABLE, PrimitiveFit
from sdftrack.results import Status

WEAK_INLIERS, LOST_INLIERS = 0.6, 0.2
# Share of the measurements times that of the outline, below which a solid is another shape: recorded boxes and
# cylinders have 0.73 or more, other recorded objects 0.50 to 0.74 (docs/results/primitives.md).
LIKE_IT = 0.72
ENDLESS_M = 100.0  # of a length that was found: nothing before a depth camera is as long
EXPONENTS = (0.1, 2.0)  # of a superquadric (the core's kLeastExponent, kMostExponent)
MIN_M, MAX_M = 1e-7, 1e6  # of a start's lengths: beyond them nothing is left of a float's digits
FARTHEST = 2  # a length is at most so many extents of the measurements (the core's kFarthest)
UNTOLD = 2  # measurements more than unknowns, up to which their spread tells no variance (the core's kUntold)


class FitRequest:
    """A validated request for a fit."""

    def __init__(self, kind: str, initial: Any, seed: int, scaling: str, threads: int) -> None:
        one_of(kind, (*KINDS, "auto"), "kind")
        one_of(scaling, _core.Scaling.__members__, "scaling")
        seed = whole(seed, "seed", 0, 2**32 - 1)
        self.pose: NDArray[np.float64] | None = None
        self.size: list[float] | None = None
        self.options = _core.PrimitiveFitOptions()
        self.options.seed, self.options.scaling = seed, _core.Scaling.__members__[scaling]
        self.threads = whole(threads, "threads", 0, what=THREADS)
        self.kinds = SOLIDS if kind == "auto" else (kind,)
        if initial is not None:
            self._begin_at(kind, initial)

    def _begin_at(self, kind: str, initial: Any) -> None:
        if isinstance(initial, PrimitiveFit):
            if kind not in ("auto", initial.kind):
                raise ValueError(f"initial: expected a fit of a {kind}, got one of a {initial.kind}")
            kind, initial = initial.kind, (initial.T_cam_obj, initial.size)
        if kind == "auto":
            raise ValueError(
                "initial: expected a kind with it, got kind='auto'; name the kind, or pass a PrimitiveFit"
            )
        if not (isinstance(initial, tuple) and len(initial) == 2 and isinstance(initial[1], dict)):
            raise TypeError(
                "initial: expected a PrimitiveFit or (T_cam_obj, {name: m}), got " + type(initial).__name__
            )
        names = SIZES[kind]
        if set(initial[1]) != set(names):
            raise ValueError(
                f"initial: expected the lengths {', '.join(names)} of a {kind}, got {list(initial[1])}"
            )
        sizes = np.array([number(initial[1][name], "initial") for name in names])
        lengths, exponents = sizes[TABLE[kind].is_length], sizes[~TABLE[kind].is_length]
        if not ((lengths >= MIN_M) & (lengths <= MAX_M)).all():
            got = lengths.tolist()
            raise ValueError(f"initial: expected lengths above 0 m ({MIN_M:g} to {MAX_M:g} m), got {got}")
        if not ((EXPONENTS[0] <= exponents) & (exponents <= EXPONENTS[1])).all():
            raise ValueError(f"initial: expected exponents of 0.1 to 2, got {exponents.tolist()}")
        self.pose = rigid_pose(initial[0], "initial")
        self.size, self.kinds = sizes.tolist(), (kind,)

    @property
    def flat(self) -> bool:
        """Whether coplanar points are sufficient."""
        return self.kinds == ("plane",)

    def min_points(self) -> int:
        """Minimum number of points: the number of unknowns."""
        return min(FREE[kind] for kind in self.kinds)


def solve(view: Any, request: FitRequest) -> PrimitiveFit:
    """Fit the best of the requested kinds."""
    of_kind(request, FitRequest, "request")
    points = len(view.points)
    kinds = [k for k in request.kinds if points >= FREE[k]]
    if not kinds:
        raise ValueError(
            f"points: expected at least {request.min_points()} points of a "
            f"{' or '.join(request.kinds)}, got {points}"
        )
    answers = view.fit(
        [TABLE[k].member for k in kinds], request.options, request.pose, request.size, request.threads
    )
    found = {k: a for k, a in zip(kinds, answers, strict=True) if a is not None}
    if not found:
        raise ValueError(
            f"points: no {' or '.join(kinds)} could be initialised from {points} points; they may lie on a line, or in "
            "a plane: give more points, farther apart, or an initial value (initial=)"
        )
    scores = _scores(found)
    best = next(iter(scores))
    answer = found[best]
    if request.pose is None and len(SIZES[best]) >= 3:  # a start has named its axes
        answer = descending(answer, 3 if len(SIZES[best]) == 3 else 2)
    return _result(best, answer, scores)


def unbounded(names: list[str]) -> str:
    """The reason for a fit in which only these sizes are not bounded; empty if there are none."""
    exponents = [name for name in names if name in ("e1", "e2")]
    lengths = [name for name in names if name not in exponents]
    parts = []
    if lengths:
        parts.append(f"the observation does not bound {' and '.join(lengths)}: the value is a lower bound")
    if exponents:
        parts.append(f"the observation does not determine {' and '.join(exponents)}")
    return "; ".join(parts)


def _scores(found: dict[str, dict[str, Any]]) -> dict[str, float]:
    against = np.array([a["against"] for a in found.values()])
    weight = np.exp(-(against - against.min()))
    weight /= weight.sum()
    scores = {
        k: float(w * a["inliers"] * a["outline"]) for (k, a), w in zip(found.items(), weight, strict=True)
    }
    order = np.argsort(against, kind="stable")
    names = list(found)
    return {names[i]: scores[names[i]] for i in order}


def _result(kind: str, answer: dict[str, Any], scores: dict[str, float]) -> PrimitiveFit:
    names, T = SIZES[kind], answer["T_cam_obj"]
    covariance = answer["covariance"].copy()
    loose = [name for name, held in zip(names, answer["bounded"], strict=True) if not held]
    far = [name for name, ends in zip(names, answer["far"], strict=True) if ends]
    endless = [name for name, length in zip(names, answer["size"], strict=True) if not length < ENDLESS_M]
    if endless:
        covariance = np.diag(np.full(len(covariance), np.inf))
        loose = []
    for i, held in enumerate(answer["bounded"]):
        if held or endless:
            continue
        covariance[6 + i, :] = covariance[:, 6 + i] = 0
        covariance[6 + i, 6 + i] = np.inf
        # Where its ends are not known, nor is the middle between them.
        if TABLE[kind].is_length[i]:
            axis = T[:3, TABLE[kind].size_axes[i]]
            covariance[:3, :3] += answer["size"][i] ** 2 * np.outer(axis, axis)
    status, reason = Status.OK, ""
    inliers = float(answer["inliers"])
    if endless:
        status = Status.LOST
        reason = f"{' and '.join(endless)} diverged: the observed surface is nearly flat; is it of this kind?"
    elif inliers < WEAK_INLIERS:
        status = Status.LOST if inliers < LOST_INLIERS else Status.WEAK
        reason = f"only {100 * inliers:.0f} % of the depth measurements are on its surface"
    elif TABLE[kind].has_inside and inliers * answer["outline"] < LIKE_IT:
        status = Status.WEAK
        reason = (
            f"it may be none of these solids: {100 * inliers:.0f} % of the depth measurements are on the surface of "
            f"this {kind}, and {100 * answer['outline']:.0f} % of the outline is its own"
        )
    elif answer["freedom"] <= UNTOLD:
        status = Status.WEAK
        reason = (
            f"{FREE[kind] + answer['freedom']} measurements are too few to separate noise from the {FREE[kind]} "
            f"unknowns of a {kind}: the errors of its lengths are unknown"
        )
    elif loose:
        status = Status.WEAK
        reason = unbounded([name for name in loose if name not in far])
        if far:
            held = (
                f"{' and '.join(far)} is not determined: it grew to {FARTHEST:g} times the extent of the measurements, "
                "where it was held"
            )
            reason = "; ".join(filter(None, (held, reason)))
    return PrimitiveFit(
        kind=kind, T_cam_obj=T, size=dict(zip(names, answer["size"], strict=True)), covariance=covariance,
        rms=float(answer["rms"]), inliers=inliers, status=status, reason=reason, scores=scores,
    )  # fmt: skip


# -- One order for the axes of a solid that has three of its own: a box, an ellipsoid, a superquadric


def descending(answer: dict[str, Any], alike: int) -> dict[str, Any]:
    """The core's answer with its axes renamed: x along the longest of the first `alike` lengths, and so on."""
    # Of the four turns that give the same solid, the one whose z points towards the camera and whose x points to the
    # right of the image. Pose covariances are in camera axes and do not change.
    size = np.asarray(answer["size"])
    order = np.arange(len(size))
    order[:alike] = np.argsort(-size[:alike], kind="stable")
    T = np.array(answer["T_cam_obj"])
    x, z = T[:3, order[0]], T[:3, order[2]]
    x, z = x if x[0] >= 0 else -x, z if z[2] <= 0 else -z
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    rows = np.concatenate([np.arange(6), 6 + order])
    renamed = {name: [answer[name][i] for i in order] for name in ("size", "bounded", "far")}
    covariance = np.asarray(answer["covariance"])[np.ix_(rows, rows)]
    return {**answer, **renamed, "T_cam_obj": T, "covariance": covariance}
