# SPDX-License-Identifier: MIT
"""Alternating re-estimation of all kept poses and the shape, which removes drift from both."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core, metrics
from sdftrack.reconstruction.keyframe import Keyframe, Refined
from sdftrack.tracking import Tracker
from sdftrack.tracking.interface import TrackerInterface

__all__ = ["refine", "track_again"]

TRACKING = 0.4  # of a round's time; the rest is fusing


def refine(
    keyframes: list[Keyframe],
    tracker: Tracker,
    size: tuple[int, int],
    fuse_all: Callable[[Callable[[float], None]], None],
    rounds: int,
    progress: Callable[[float], None] | None,
) -> Refined:
    """In each round, track every keyframe against the shape, then rebuild the shape (`fuse_all`)."""
    moved, turned = [], []
    for k in range(rounds):

        def tell(share: float, first: float = k / rounds) -> None:
            if progress is not None:
                progress(first + share / rounds)

        anchor = keyframes[0].T_cam_obj
        steps = []
        for i, keyframe in enumerate(keyframes):
            steps.append(track_again(keyframe, tracker, size))
            tell(TRACKING * i / len(keyframes))
        # The young shape took the first frame's noise for its form: all others know better where that one was.
        back = np.linalg.solve(keyframes[0].T_cam_obj, anchor)
        for keyframe in keyframes:
            keyframe.T_cam_obj = keyframe.T_cam_obj @ back
        fuse_all(lambda share, tell=tell: tell(TRACKING + (1 - TRACKING) * share))  # type: ignore[misc]
        rms = np.sqrt(np.mean(np.square(steps), axis=0))
        moved.append(float(rms[0]))
        turned.append(float(rms[1]))
    poses: dict[int, NDArray[np.float64]] = {keyframe.index: keyframe.T_cam_obj for keyframe in keyframes}
    return Refined(poses, rounds, moved, turned)


def track_again(keyframe: Keyframe, tracker: Tracker, size: tuple[int, int]) -> tuple[float, float]:
    """Track a keyframe against the current shape; returns the change of its pose (m, rad)."""
    tracker.set_pose(0, keyframe.T_cam_obj)
    color = None if tracker.mode == "depth" else keyframe.full_color(*size)
    places = None if color is None else _core.ColorMap.aligned(size[1], size[0])
    poses, sure = TrackerInterface(tracker).revisit(keyframe.full_depth(*size), color, places)
    if not sure[0]:
        return 0.0, 0.0
    before, keyframe.T_cam_obj = keyframe.T_cam_obj, poses[0]
    return metrics.pose_error(keyframe.T_cam_obj, before)
