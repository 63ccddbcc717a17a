# SPDX-License-Identifier: MIT
"""Start without a hint after the search of the whole image has failed: objects standing on planes are tested."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from sdftrack.camera import depth_camera
from sdftrack.imaging.click_regions import click_regions
from sdftrack.imaging.standing_regions import standing_regions
from sdftrack.results import Status, TrackResult
from sdftrack.tracking.hypothesis_score import score_pose
from sdftrack.tracking.scale import size_of
from sdftrack.tracking.start_by_click import StartHypothesis

__all__ = [
    "FOUND_STANDING",
    "MIN_CONFIDENCE",
    "best_anywhere",
    "is_unconvincing",
    "search_confidence",
    "unconfirmed",
]

FOUND_STANDING = "found among the objects on a plane; the next frame must confirm it"
MIN_CONFIDENCE = 0.45  # belief from which a region is taken for the object, without anybody's word
AMBIGUOUS = 0.8  # of the best score, from which the second one halves the confidence
SURE = 0.6  # belief from which nothing else is tried
CLICKED = 3  # of the likeliest regions, that are looked at with their colours where no region is


def best_anywhere(sdf: Any, camera: Any, frame: Any, start: Callable[..., Any]) -> StartHypothesis | None:
    """The region with the best match of the object, or None; `start` as for a click."""
    if frame.depth is None or not (frame.depth > 0).any():
        return None
    standing = standing_regions(frame, camera, size_of(sdf))
    best, most = None, 0.0
    for region in standing.regions:
        belief, hypothesis = _tried(sdf, camera, frame, region, start)
        if belief > most:
            best, most = hypothesis, belief
    for pixel in [*map(middle_of, standing.regions[:CLICKED]), *standing.pixels]:
        if most > SURE:
            break
        try:
            regions = click_regions(frame, camera, pixel, size_of(sdf))
        except ValueError:
            continue
        for region in regions:
            belief, hypothesis = _tried(sdf, camera, frame, region, start)
            if belief > most:
                best, most = hypothesis, belief
    return best if most >= MIN_CONFIDENCE else None


def _tried(
    sdf: Any, camera: Any, frame: Any, region: Any, start: Callable[..., Any]
) -> tuple[float, StartHypothesis]:
    """Confidence that the object is in a region, 0..1."""
    try:
        result = start(masks=[region])
    except ValueError:  # of a size that cannot be the object's
        return 0.0, StartHypothesis(region, None, None)
    if result.status[0] is Status.LOST:
        return 0.0, StartHypothesis(region, None, None)
    score = score_pose(sdf, depth_camera(camera), frame.depth, result.poses[0], region, middle_of(region))
    return score.value * search_confidence(result), StartHypothesis(region, None, score)


def search_confidence(result: TrackResult, k: int = 0) -> float:
    """Confidence in a start, ignoring ambiguity between symmetric rotations; 0: lost."""
    if result.status[k] is Status.LOST or result.status[k] is Status.BAD_FRAME:
        return 0.0
    runner_up = float(result.runner_up[k])
    return float(result.confidence[k]) * (1 + (runner_up if runner_up >= AMBIGUOUS else 0.0))


def is_unconvincing(result: TrackResult) -> bool:
    """Whether a search of the whole image has not found the only object, or only with low confidence."""
    return result.status[0] in (Status.LOST, Status.WEAK) and search_confidence(result) < MIN_CONFIDENCE


def unconfirmed(result: TrackResult) -> TrackResult:
    """Mark the only object of a result as weak: its presence has not been confirmed."""
    if result.status[0] is Status.LOST:
        return result
    confidence = 0.5 * result.confidence
    confidence.flags.writeable = False
    reason = [result.reason[0] or FOUND_STANDING]
    return replace(result, status=[Status.WEAK], reason=reason, confidence=confidence)


def middle_of(region: Any) -> tuple[int, int]:
    """(x, y) of the pixel of a region that is nearest to its centroid."""
    v, u = np.nonzero(region)
    k = int(np.argmin((v - v.mean()) ** 2 + (u - u.mean()) ** 2))
    return int(u[k]), int(v[k])
