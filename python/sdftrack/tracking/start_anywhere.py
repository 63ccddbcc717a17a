# SPDX-License-Identifier: MIT
"""Start without a hint after the search of the whole image has failed: objects standing on planes are tested."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sdftrack.camera import depth_camera
from sdftrack.imaging.click_regions import click_regions
from sdftrack.imaging.standing_regions import standing_regions
from sdftrack.results import Status, TrackResult
from sdftrack.tracking.scale import size_of
from sdftrack.tracking.start_by_click import StartHypothesis, best_at_click, click_list, score_pose

if TYPE_CHECKING:
    from sdftrack.camera import Camera
    from sdftrack.frame import Frame
    from sdftrack.imaging.pose_hint import Place
    from sdftrack.tracking.tracker import Tracker

FOUND_STANDING = "found among the objects on a plane; the next frame must confirm it"
MIN_CONFIDENCE = 0.45  # belief from which a region is taken for the object, without anybody's word
AMBIGUOUS = 0.8  # of the best score, from which the second one halves the confidence
APART_PX = 30  # between two places that are shown
SURE = 0.6  # belief from which nothing else is tried
CLICKED = 3  # of the likeliest regions, that are looked at with their colours where no region is


def best_anywhere(
    sdf: Any, camera: Any, frame: Any, start: Callable[..., Any]
) -> tuple[StartHypothesis | None, list[tuple[int, int]]]:
    """The region with the best match of the object, or None; pixels (x, y) in the two best. `start` as for a click."""
    if frame.depth is None or not (frame.depth > 0).any():
        return None, []
    standing = standing_regions(frame, camera, size_of(sdf))
    best, most = None, 0.0
    places: list[tuple[float, tuple[int, int]]] = []

    def consider(region: Any) -> None:
        nonlocal best, most
        belief, hypothesis = _tried(sdf, camera, frame, region, start)
        if belief > 0:
            places.append((belief, middle_of(region)))
        if belief > most:
            best, most = hypothesis, belief

    for region in standing.regions:
        consider(region)
    for pixel in [*map(middle_of, standing.regions[:CLICKED]), *standing.pixels]:
        if most > SURE:
            break
        try:
            regions = click_regions(frame, camera, pixel, size_of(sdf))
        except ValueError:
            continue
        for region in regions:
            consider(region)
    places.sort(reverse=True)
    apart = [p for k, (_, p) in enumerate(places) if all(math.dist(p, q) > APART_PX for _, q in places[:k])]
    return (best if most >= MIN_CONFIDENCE else None), apart[:2]


def _tried(
    sdf: Any, camera: Any, frame: Any, region: Any, start: Callable[..., Any]
) -> tuple[float, StartHypothesis]:
    """Confidence that the object is in a region, 0..1."""
    nothing = 0.0, StartHypothesis(region)
    try:
        result = start(masks=[region])
    except ValueError:  # of a size that cannot be the object's
        return nothing
    if result.status[0] is Status.LOST:
        return nothing
    score = score_pose(sdf, depth_camera(camera), frame.depth, result.poses[0], region, middle_of(region))
    return score * search_confidence(result), StartHypothesis(region, None, score)


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


def _with_places(result: TrackResult, places: list[tuple[int, int]]) -> TrackResult:
    """Name where an object that was not found might be, for a click there."""
    if result.status[0] is not Status.LOST or not places:
        return result
    shown = " or ".join(f"({x}, {y})" for x, y in places)
    return replace(result, reason=[f"{result.reason[0]}; it might be at pixel {shown}: try a click there"])


def middle_of(region: Any) -> tuple[int, int]:
    """(x, y) of the pixel of a region that is nearest to its centroid."""
    v, u = np.nonzero(region)
    k = int(np.argmin((v - v.mean()) ** 2 + (u - u.mean()) ** 2))
    return int(u[k]), int(v[k])


# -- Start from clicks or without hints: hypotheses are tested with a tracker of a single shape


def clicked_places(tracker: Tracker, clicks: Any, frame: Frame, camera: Camera) -> list[Place]:
    """For each object the hint derived from its click; `camera`: the frame's depth camera."""
    pixels = click_list(clicks, len(tracker.shapes), camera)
    full = tracker.camera if frame.camera is None else frame.camera
    return [
        hypothesis_at_click(tracker, k, frame, px, f"clicks[{k}]").place(full) for k, px in enumerate(pixels)
    ]


def hypothesis_at_click(
    tracker: Tracker, k: int, frame: Frame, px: tuple[float, float], name: str
) -> StartHypothesis:
    """The hypothesis for object k after a click on it, tested with a tracker of it alone; errors begin with `name`."""
    if tracker._free_sizes.shapes_unknown(k):
        raise ValueError(f"{name}: expected a shape of known size, got a Primitive; give a mask or box of it")
    alone = tracker._alone_with(k, frame)
    camera = tracker.camera if frame.camera is None else frame.camera
    try:
        return best_at_click(
            tracker.shapes[k], camera, frame, px, lambda **where: alone.start(frame, **where)
        )
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def found_anywhere(
    tracker: Tracker, frame: Frame, camera: Camera, colors: tuple[Any, Any], result: TrackResult
) -> TrackResult:
    """If the search of the whole image failed for the only object, test the objects standing on planes."""
    if len(tracker.shapes) > 1 or tracker._free_sizes.shapes_unknown(0) or not is_unconvincing(result):
        return result
    alone = tracker._alone_with(0, frame)
    full = tracker.camera if frame.camera is None else frame.camera
    found, places = best_anywhere(tracker.shapes[0], full, frame, lambda **where: alone.start(frame, **where))
    if found is None:
        tracker._last = _with_places(result, places)
        return tracker._last
    tracker._last = unconfirmed(tracker._start_at(frame, camera, colors, [found.place(full)]))
    return tracker._last
