# SPDX-License-Identifier: MIT
"""Shapes of known form and unknown scale: their volumes follow the scale that the core estimates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from sdftrack.imaging.pose_hint import Place, is_mask
from sdftrack.results import ScaleEstimate, Status, TrackResult
from sdftrack.sdf import SDF

FITS = 6  # of a start, at most: each estimates the scale anew
ROUNDS = 2  # of a candidate
VIEWS = (1.0, 1.2, 1.45, 1.75)  # diameters over the extents of views


def free_scales(scale: Any, shapes: Sequence[Any], unknown: Any) -> list[bool]:
    """Which of the shapes have a free scale; `unknown`: whether the size of shape k is estimated anyway."""
    many = isinstance(scale, (list, tuple))
    given = list(scale) if many else [scale] * len(shapes)
    if len(given) != len(shapes):
        raise ValueError(f"scale: expected one or None per shape ({len(shapes)}), got {len(given)}")
    for k, one in enumerate(given):
        if one not in (None, "free"):
            raise ValueError(f"scale{f'[{k}]' if many else ''}: expected None or 'free', got {one!r}")
        if one and unknown(k):
            raise ValueError(f"scale: expected None for shape {k}, a Primitive, whose sizes are free anyway")
    return [one == "free" for one in given]


def rescaled(sdf: SDF, factor: float) -> SDF:
    """The volume enlarged about the origin of its frame."""
    return SDF(sdf.values * np.float32(factor), sdf.voxel_size * factor, sdf.origin * factor, sdf.colors)


def adjust(tracker: Any, k: int) -> float:
    """Give object k the scale that its measurements show; returns the log scale that was added."""
    log_scale = float(tracker._core.log_scale_to_add(k))
    if log_scale != 0:
        resize(tracker, k, log_scale)
    return log_scale


def resize(tracker: Any, k: int, log_scale: float) -> None:
    """Enlarge the volume of object k by exp(`log_scale`)."""
    volume = rescaled(tracker.shapes[k], math.exp(log_scale))
    tracker._core.rescale(k, volume._core_args, log_scale)
    tracker.shapes[k] = volume
    symmetry = tracker._symmetries[k]
    tracker._symmetries[k] = symmetry and symmetry.enlarged(math.exp(log_scale))


def start(tracker: Any, run: Any, view: Any, places: list[Place], free: list[int]) -> TrackResult:
    """Start at places with the scale that fits best; `run`: start of the core at places; `view`: its frame."""
    sizes = [tracker.shapes[k].voxel_size for k in free]
    for k in free:
        if is_mask(places[k]):
            _try_candidates(tracker, run, view, places, k)
    result, _ = _converged(tracker, run, places, free, FITS)
    if sizes == [tracker.shapes[k].voxel_size for k in free]:
        return result
    return cast("TrackResult", run(places))


def _try_candidates(tracker: Any, run: Any, view: Any, places: list[Place], k: int) -> None:
    """Give object k the scale, of those that the extent of its mask allows, that explains the frame best."""
    diameter, seen = tracker._core.diameter(k), tracker._core.extent(view, places[k])
    if seen == 0 or diameter == 0:
        return
    now, best, confidence = 0.0, 0.0, -1.0
    for log_scale in (0.0, *(math.log(view * seen / diameter) for view in VIEWS)):
        resize(tracker, k, log_scale - now)
        result, added = _converged(tracker, run, places, [k], ROUNDS)
        now = log_scale + added
        if result.confidence[k] > confidence:
            best, confidence = now, float(result.confidence[k])
    resize(tracker, k, best - now)


def _converged(
    tracker: Any, run: Any, places: list[Place], free: list[int], fits: int
) -> tuple[TrackResult, float]:
    """The result of the last start, and the log scales that were added, as a sum."""
    result: TrackResult = run(places)
    total = 0.0
    for _ in range(fits - 1):
        added = [adjust(tracker, k) for k in free if result.status[k] is not Status.LOST]
        if not any(added):
            break
        total += sum(added)
        poses = tracker._core.best
        result = run(
            [
                poses[k] if k in free and np.isfinite(poses[k]).all() else place
                for k, place in enumerate(places)
            ]
        )
    return result, total


def estimate(tracker: Any, k: int) -> ScaleEstimate:
    """Scale of object k over the volume that was given."""
    mean, sd = tracker._core.scale(k)
    return ScaleEstimate(math.exp(mean), math.exp(mean) * sd)
