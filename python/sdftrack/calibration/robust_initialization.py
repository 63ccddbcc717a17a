# SPDX-License-Identifier: MIT
"""Robust initial mapping from pairs with outliers, with a possible delay of colour."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.pairs import BallPairs, Path
from sdftrack.calibration.projective import dlt, resection
from sdftrack.calibration.robust_fit import Fit, consensus, fit_map
from sdftrack.camera import Camera

__all__ = ["BAND_PX", "first_map"]

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
