# SPDX-License-Identifier: MIT
"""Turns of a pose that a search may have missed: a body that is nearly one of revolution shows its handle late."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import depth_camera
from sdftrack.tracking.hypothesis_score import HypothesisScore, score_pose

__all__ = ["best_turned"]

Pose = NDArray[np.float64]

STEPS = 24  # turns of a circle about each principal axis
PIXELS = 160  # along the longer side of the image that turns are compared in
FITTED = 3  # of the best turns, that are fitted
APART_RAD = np.deg2rad(20.0)  # between them
BETTER = 1.01  # times the score: less is not worth leaving what the search has found
SAMPLES = 500


def best_turned(
    sdf: Any,
    camera: Any,
    frame: Any,
    T: Pose,
    score: HypothesisScore,
    region: NDArray[np.bool_],
    px: tuple[int, int],
    start: Callable[..., Any],
) -> tuple[Pose, HypothesisScore] | None:
    """A pose, turned about one of the shape's principal axes and fitted, that explains clearly more than `T` does.

    Parameters
    ----------
    T : (4, 4) float64
        What a search has found, with its `score`.
    region : (H, W) bool
    px : (x, y)
    start : function
        ``start(poses=T)`` of a tracker of this shape alone: its result.

    Returns
    -------
    (4, 4) float64 and its score, or None
    """
    lens = depth_camera(camera)
    every = max(1, max(frame.depth.shape) // PIXELS)
    small = lens.scaled(1 / every)
    v, u = (np.minimum(every * np.arange(n) + every // 2, m - 1) for n, m in zip(small.shape, lens.shape, strict=True))
    depth, inside = np.ascontiguousarray(frame.depth[np.ix_(v, u)]), region[np.ix_(v, u)]
    at = (min(px[0] // every, small.width - 1), min(px[1] // every, small.height - 1))
    found: list[tuple[float, Pose]] = []
    for S in _turns(sdf):
        found.append((score_pose(sdf, small, depth, T @ S, inside, at).value, T @ S))
    found.sort(key=lambda f: -f[0])
    best: tuple[Pose, HypothesisScore] | None = None
    tried: list[Pose] = [T]
    for value, turned in found:
        if len(tried) > FITTED or value < 0.8 * found[0][0]:
            break
        if any(_angle(turned, other) < APART_RAD for other in tried):
            continue
        tried.append(turned)
        result = start(poses=turned)
        if str(result.status[0]) == "lost":
            continue
        now = score_pose(sdf, lens, frame.depth, result.poses[0], region, px)
        if now.value > BETTER * (score if best is None else best[1]).value:
            best = result.poses[0].copy(), now
    return best


def _turns(sdf: Any) -> list[Pose]:
    """Motions about the principal axes through the middle of the surface."""
    points = sdf.surface_samples(SAMPLES)[0].astype(float)
    middle = points.mean(axis=0)
    axes = np.linalg.eigh(np.cov((points - middle).T))[1].T
    turns = []
    for axis in axes:
        for k in range(1, STEPS):
            S = np.array(_core.rotation_exp((2 * np.pi * k / STEPS * axis).tolist()))
            S[:3, 3] = middle - S[:3, :3] @ middle
            turns.append(S)
    return turns


def _angle(A: Pose, B: Pose) -> float:
    return float(np.arccos(np.clip(0.5 * (np.trace(A[:3, :3].T @ B[:3, :3]) - 1), -1, 1)))
