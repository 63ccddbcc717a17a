# SPDX-License-Identifier: MIT
"""Levenberg-Marquardt on the reprojection error (thesis Eq. 3.26) with Huber's loss, outliers and the covariance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.pairs import BallPairs, Path
from sdftrack.calibration.projective import dlt, resection
from sdftrack.camera import Camera

Array = NDArray[np.float64]
HUBER = 2.0  # standard deviations of a pair's residual (two coordinates) where the loss becomes linear
DROPPED = 13.82  # squared: chi-square with two degrees of freedom, 0.1 % of true pairs are dropped
MAX_OFF_PX = 25.0  # of a right pair: a colour image 40 ms late, at 1 m/s
FLOOR_PX = 0.02  # of a colour centre's sd: what sampling of the image leaves even without noise
STEPS = 60
MEDIAN_CHI2 = 1.3863  # median of chi-square with two degrees of freedom
# What the stated noise of the centres counts for, as if so many coordinates had been measured to have it: a dozen
# pairs on eleven unknowns would else say by chance that there is none.
STATED_FREEDOM = 10
MIN_SHARE_LEFT = 0.05  # of a residual's variance that the unknowns leave: below, it says nothing of its pair
# Variance of an estimate under Huber's loss over that of plain squares, for Gaussian pairs: with the length r of a
# pair, E[min(r, k)^2] / 2 over (E[1; r < k] + E[k / (2 r); r > k])^2 at k = 2 (docs/math/color_to_depth.md, eq. 15).
HUBER_COST = 1.018


@dataclass(frozen=True, eq=False)
class Fit:
    """A mapping, the time offset (s), covariance of (mapping, offset), residuals (N, 2) px, inlier pairs (N,)."""

    map: Any
    offset_s: float
    covariance: Array
    residual_px: Array
    kept: NDArray[np.bool_]
    scale: float
    freedom: int  # of the variance: coordinates of kept pairs less the unknowns, and what the stated noise counts for


def fit_map(
    start: Any,
    pairs: BallPairs,
    kept: NDArray[np.bool_] | None = None,
    path: Path | None = None,
    offset_s: float = 0.0,
) -> Fit:
    """Refine a mapping on pairs, and with a `path` of the ball also the time offset.

    Each residual is whitened by the covariances of both centres. After each minimisation the scale of the residuals is
    estimated from their median, pairs beyond the 0.1 % quantile of a chi-square are rejected, and the minimisation is
    repeated until the set is stable. Pairs not `kept` at the start may be readmitted.
    """
    x, dt, scale = start, offset_s, 1.0
    kept = np.ones(len(pairs), dtype=np.bool_) if kept is None else kept
    unknowns = x.unknowns + (path is not None) - (x.unknowns == 12)
    for _ in range(12):
        x, dt, H = _minimum(x, dt, pairs, path, kept, scale)
        r, white, _ = _residuals(x, dt, pairs, path)
        usable = np.isfinite(white).all(axis=1)
        usable &= np.linalg.norm(np.nan_to_num(r), axis=1) < MAX_OFF_PX
        length2 = np.where(
            usable, _studentised(np.nan_to_num(white), _rows(x, dt, pairs, path), kept & usable), np.inf
        )
        count = int(np.count_nonzero(usable & kept))
        if 2 * count <= unknowns:
            break
        # The median of all pairs, dropped ones too: of the kept ones alone it would shrink with every pair dropped, and
        # drop more.
        measured = float(np.median(length2[usable])) / MEDIAN_CHI2
        scale = float(np.sqrt(_with_the_stated(measured, 2 * count - unknowns)))
        now = usable & (length2 < DROPPED * scale**2)
        if np.array_equal(now, kept):
            break
        kept = now
    count = int(np.count_nonzero(kept & usable))
    left = max(2 * count - unknowns, 0)
    squares = float((white[kept & usable] ** 2).sum())
    variance = _with_the_stated(squares / max(left, 1), left)
    covariance = HUBER_COST * variance * _inverse(H, x)
    s = np.append(x.scales, 1.0) if path is not None else x.scales
    return Fit(
        x, dt, covariance * np.outer(s, s), r, kept & usable, float(np.sqrt(variance)), left + STATED_FREEDOM
    )


def _with_the_stated(measured: float, freedom: int) -> float:
    """Ratio of the variance to the stated one: as measured if larger, else shrunk towards 1 for few data."""
    return max(measured, (freedom * measured + STATED_FREEDOM) / (freedom + STATED_FREEDOM))


def _rows(x: Any, dt: float, pairs: BallPairs, path: Path | None) -> Array:
    return _residuals(x, dt, pairs, path)[2]


def _studentised(white: Array, J: Array, kept: NDArray[np.bool_]) -> Array:
    """(N,) squared studentised residuals r^T (I -+ J H^+ J^T)^-1 r: those of fitted pairs are too small.

    A fitted pair (minus) has pulled the mapping towards itself; for a pair not fitted (plus) the uncertainty of the
    mapping adds.
    """
    J = np.nan_to_num(J)
    H = np.einsum("nka,nkb->ab", J[kept], J[kept])
    d = 1 / np.sqrt(np.diag(H) + 1e-300)
    inverse = d[:, None] * np.linalg.pinv(H * np.outer(d, d), rcond=1e-10, hermitian=True) * d
    leverage = np.einsum("nka,ab,nlb->nkl", J, inverse, J)
    values, vectors = np.linalg.eigh(np.eye(2) + np.where(kept, -1.0, 1.0)[:, None, None] * leverage)
    along = np.einsum("nkj,nk->nj", vectors, white)
    # Where the unknowns leave nothing of a residual, nothing is said of its pair.
    said = values > MIN_SHARE_LEFT
    return np.asarray(np.where(said, along**2 / np.where(said, values, 1.0), 0.0).sum(axis=1))


def _inverse(H: Array, x: Any) -> Array:
    """Inverse of the Hessian in scaled parameters; the unobservable scale of a projective mapping is fixed."""
    if x.unknowns != 12:
        inverse: Array = np.asarray(np.linalg.pinv(H, hermitian=True), dtype=np.float64)
        return inverse
    free = np.zeros(len(H))
    free[:12] = x.M.ravel() / x.scales
    free /= np.linalg.norm(free)
    # Both sides in units of the Hessian's diagonal, or rounding would eat the least known direction.
    d: Array = 1 / np.sqrt(np.diag(H) + 1e-300)
    held = np.outer(free, free) * np.mean(np.diag(H))
    scaled = np.asarray(np.linalg.pinv((H + held) * np.outer(d, d), rcond=1e-15, hermitian=True))
    return np.asarray(d[:, None] * scaled * d, dtype=np.float64)


def consensus(
    solve: Callable[[NDArray[np.intp]], Any],
    pairs: BallPairs,
    smallest: int,
    band_px: float,
    seed: int,
    tries: int = 200,
) -> tuple[Any, NDArray[np.bool_], float]:
    """RANSAC: the mapping from few pairs with the most inliers within `band_px`, the inliers, and their score."""
    rng = np.random.default_rng([seed, 21])
    n = len(pairs)
    best: Any = None
    agree: NDArray[np.bool_] = np.zeros(n, np.bool_)
    score = -1.0
    for k in range(tries):
        chosen = np.arange(n) if k == 0 else rng.choice(n, smallest, replace=False)
        x = solve(chosen)
        for _ in range(2):
            if x is None:
                break
            off = np.linalg.norm(x.predict(pairs.center_cam)[0] - pairs.color_px, axis=1)
            off = np.where(np.isfinite(off), off, np.inf)
            inside: NDArray[np.bool_] = np.asarray(off < band_px, dtype=np.bool_)
            # Among maps with as many pairs the tighter one.
            value = float(np.maximum(0, 1 - (off / band_px) ** 2).sum())
            if value > score:
                best, agree, score = x, inside, value
            x = solve(np.flatnonzero(inside)) if np.count_nonzero(inside) > smallest else None
        if score > 0.9 * n and k >= 20:
            break
    return best, agree, score


def _residuals(x: Any, dt: float, pairs: BallPairs, path: Path | None) -> tuple[Array, Array, Array]:
    """Residuals (N, 2) px, whitened ones, and whitened derivatives (N, 2, unknowns [+ 1])."""
    p, C = pairs.center_cam, pairs.center_covariance
    velocity = None
    if path is not None:
        p, velocity, share = path.at(pairs.time_s + dt)
        C = C * (share**2).sum(axis=1)[:, None, None]
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(p).all(axis=1), dtype=np.bool_)
    px, J, by_point = x.predict(np.where(seen[:, None], p, 1.0))
    r = np.where(seen[:, None], pairs.color_px - px, np.nan)
    J = J * x.scales
    if velocity is not None:
        J = np.concatenate([J, by_point @ np.nan_to_num(velocity)[..., None]], axis=2)
    S = pairs.color_covariance + FLOOR_PX**2 * np.eye(2) + by_point @ C @ np.swapaxes(by_point, 1, 2)
    with np.errstate(invalid="ignore"):
        fine = seen & np.isfinite(S).all(axis=(1, 2)) & np.isfinite(px).all(axis=1)
    S[~fine] = np.eye(2)
    L = np.linalg.cholesky(S)
    white = np.linalg.solve(L, np.where(fine[:, None], r, np.nan)[..., None])[..., 0]
    return r, white, np.linalg.solve(L, J)


def _minimum(
    x: Any, dt: float, pairs: BallPairs, path: Path | None, kept: NDArray[np.bool_], scale: float
) -> tuple[Any, float, Array]:
    """Levenberg-Marquardt; also returns the final Hessian of the weighted squares, in scaled parameters."""
    damping = 1e-3
    r, J, cost = _weighted(x, dt, pairs, path, kept, scale)
    for _ in range(STEPS):
        H, g = np.einsum("nka,nkb->ab", J, J), np.einsum("nka,nk->a", J, r)
        step = np.linalg.lstsq(H + damping * np.diag(np.diag(H) + 1e-12), g, rcond=None)[0]
        trial = x.moved(step[: x.unknowns] * x.scales)
        later = dt + (float(step[-1]) if path is not None else 0.0)
        r_new, J_new, cost_new = _weighted(trial, later, pairs, path, kept, scale)
        if cost_new <= cost:
            gain = cost - cost_new
            x, dt, r, J, cost = trial, later, r_new, J_new, cost_new
            damping = max(damping / 10, 1e-12)
            if gain < 1e-9 * cost + 1e-15:
                break
        else:
            damping *= 10
            if damping > 1e8:
                break
    _, white, J = _residuals(x, dt, pairs, path)
    use = kept & np.isfinite(white).all(axis=1)
    return x, dt, np.einsum("nka,nkb->ab", J[use], J[use])


def _weighted(
    x: Any, dt: float, pairs: BallPairs, path: Path | None, kept: NDArray[np.bool_], scale: float
) -> tuple[Array, Array, float]:
    """Huber's cost, and residuals and derivatives times the root of its weight."""
    _, white, J = _residuals(x, dt, pairs, path)
    lost = kept & ~np.isfinite(white).all(axis=1)
    use = kept & ~lost
    length = np.linalg.norm(white[use], axis=1) / scale
    cost = np.where(length < HUBER, 0.5 * length**2, HUBER * (length - 0.5 * HUBER))
    root = np.sqrt(np.minimum(1, HUBER / np.maximum(length, 1e-12))) / scale
    # A pair that leaves the path or the camera costs as much as one that would be dropped.
    total = float(cost.sum()) + float(np.count_nonzero(lost)) * HUBER * np.sqrt(DROPPED)
    return root[:, None] * white[use], root[:, None, None] * J[use], total


# -- Robust initial mapping from pairs with outliers, with a possible delay of colour


BAND_PX = 8.0  # of the first consensus: pairs are right or wrong by much more
LARGEST_OFFSET_S = 0.15
TRIES, LATE_TRIES = (
    200,
    40,
)  # of samples of pairs; with a delay for each of its starts, on a path freed of jumps


def first_map(
    pairs: BallPairs, depth: Camera, color: Camera | None, time_offset: bool, smallest: int, seed: int
) -> Fit:
    """The mapping (and delay) with the most inliers, refined on them."""
    path = Path.through(pairs.time_s, pairs.center_cam) if time_offset else None
    delays = [0.0]
    if path is not None:
        delays = list(np.arange(-LARGEST_OFFSET_S, LARGEST_OFFSET_S + 1e-9, max(0.01, 0.25 * path.period)))
    best: tuple[float, Any, NDArray[np.bool_], NDArray[np.bool_], float] | None = None
    for dt in delays:
        shifted = pairs
        if path is not None:
            shifted = replace(pairs, center_cam=path.at(pairs.time_s + dt)[0])
        known: NDArray[np.bool_] = np.asarray(np.isfinite(shifted.center_cam).all(axis=1), dtype=np.bool_)
        if np.count_nonzero(known) < smallest:
            continue
        tries = TRIES if path is None else LATE_TRIES
        x, inside, score = _agreed(shifted.part(known), depth, color, smallest, seed, tries)
        if x is not None and (best is None or score > best[0]):
            agree = np.zeros(len(pairs), np.bool_)
            agree[np.flatnonzero(known)[inside]] = True
            right = agree | ~known  # what the delayed path does not reach is not wrong for that
            best = score, x, agree, right, float(dt)
    if best is None or np.count_nonzero(best[2]) < smallest:
        few = len(pairs) < smallest + 3
        more = (
            f"; with so few pairs a single outlier is fatal, {2 * smallest} pairs tolerate some"
            if few
            else ""
        )
        raise ValueError(
            f"frames: no mapping agrees with {smallest} of the {len(pairs)} pairs to {BAND_PX:g} px; is the ball "
            "found in depth the one found in colour? Check the size (ball_radius) and the colour "
            f"(ball_color){more}"
        )
    _, x, agree, right, dt = best
    if path is not None:
        path = Path.through(pairs.time_s[right], pairs.center_cam[right])
    return fit_map(x, pairs, agree, path, dt)


def _agreed(
    pairs: BallPairs, depth: Camera, color: Camera | None, smallest: int, seed: int, tries: int
) -> tuple[Any, NDArray[np.bool_], float]:
    """The mapping with the most inliers within BAND_PX, the inliers, and their score."""

    def solve(chosen: NDArray[np.intp]) -> Any:
        chosen = chosen[np.isfinite(pairs.color_px[chosen]).all(axis=1)]  # an outline may make no cone
        if len(chosen) < smallest:
            return None
        p, px = pairs.center_cam[chosen], pairs.color_px[chosen]
        return dlt(p, px, depth) if color is None else resection(p, px, color, depth)

    return consensus(solve, pairs, smallest, BAND_PX, seed, tries)
