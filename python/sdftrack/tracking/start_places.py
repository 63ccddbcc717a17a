# SPDX-License-Identifier: MIT
"""Start from clicks or without hints: hypotheses are tested with a tracker of a single shape."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sdftrack.tracking.start_anywhere import best_anywhere, is_unconvincing, unconfirmed
from sdftrack.tracking.start_by_click import StartHypothesis, best_at_click, click_list

if TYPE_CHECKING:
    from sdftrack.camera import Camera
    from sdftrack.frame import Frame
    from sdftrack.imaging.pose_hint import Place
    from sdftrack.results import TrackResult
    from sdftrack.tracking.tracker import Tracker

__all__ = ["clicked_places", "found_anywhere", "hypothesis_at_click"]


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
    found = best_anywhere(tracker.shapes[0], full, frame, lambda **where: alone.start(frame, **where))
    if found is None:
        return result
    tracker._last = unconfirmed(tracker._start_at(frame, camera, colors, [found.place(full)]))
    return tracker._last
