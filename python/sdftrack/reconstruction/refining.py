# SPDX-License-Identifier: MIT
"""Alternating re-estimation of all kept poses and the shape, which removes drift from both, and its judgement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core, metrics
from sdftrack._core import Keyframe, Keyframes
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.geometry import inverse, transform_points
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker
from sdftrack.tracking.interface import TrackerInterface

__all__ = ["Keyframe", "Keyframes", "Refined", "frame_of", "whole"]


def whole(keyframe: Keyframe, part: NDArray[Any] | None, size: tuple[int, int]) -> Any:
    """A keyframe's `depth`, `rgb` or `mask` as an image (height, width) that is 0 elsewhere; None for None."""
    if part is None:
        return None
    image = np.zeros((*size, *part.shape[2:]), part.dtype)
    x0, y0, x1, y1 = keyframe.region
    image[y0:y1, x0:x1] = part
    return image


def frame_of(keyframe: Keyframe, camera: Camera) -> Frame:
    """Both images, colour aligned to depth; measurements without a colour (black) are removed."""
    depth, color = (whole(keyframe, part, camera.shape) for part in (keyframe.depth, keyframe.rgb))
    if color is None:
        return Frame(depth, camera=camera, check_units=False)
    return Frame(np.where(color.any(axis=2), depth, 0), color, camera=camera, check_units=False)


@dataclass(frozen=True)
class Refined:
    """Result of :meth:`Reconstructor.refine`.

    Attributes
    ----------
    poses : dict of int to (4, 4) float64
        Refined ``T_cam_obj`` of each kept frame, by its index.
    rounds : int
        Number of rounds in which all poses and the shape were re-estimated.
    moved_m, turned_rad : list of float
        RMS change of the object's centre and orientation in each round.
    misfit_m : (float, float)
        Mean distance of the frames' measurements from the shape before and after, m.
    taken : bool
        Whether the refined poses and shape were accepted; otherwise they are unchanged.
    """

    poses: dict[int, NDArray[np.float64]]
    rounds: int
    moved_m: list[float]
    turned_rad: list[float]
    misfit_m: tuple[float, float] = (float("nan"), float("nan"))
    taken: bool = True


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
    color = None if tracker.mode == "depth" else whole(keyframe, keyframe.rgb, size)
    places = None if color is None else _core.ColorMap.aligned(size[1], size[0])
    poses, sure = TrackerInterface(tracker).revisit(whole(keyframe, keyframe.depth, size), color, places)
    if not sure[0]:
        return 0.0, 0.0
    before, keyframe.T_cam_obj = keyframe.T_cam_obj, poses[0]
    return metrics.pose_error(keyframe.T_cam_obj, before)


# -- Misfit between a shape with its poses and the depth measurements, used to judge a refinement


# A shape that grew with its poses has taken over some of their frames' errors: what is right may fit so much worse.
OVERFIT = 1.01
FAR_M = 0.006  # a measurement farther from the surface is another thing's, or as wrong as can be
FRAMES, READINGS = 60, 1500  # that are looked at: of all frames, and of each


class Judge:
    """A fixed sample of the object's depth measurements, selected with the current shape."""

    # The same measurements judge every later shape and set of poses, so that none scores better by explaining less.

    def __init__(self, keyframes: list[Keyframe], shape: SDF, camera: Camera) -> None:
        self._frames = keyframes[:: max(1, len(keyframes) // FRAMES)]
        self._points = []
        for keyframe in self._frames:
            points = camera.back_project(whole(keyframe, keyframe.depth, camera.shape))
            points = points[points[..., 2] > 0]
            points = points[:: max(1, len(points) // READINGS)]
            near = np.abs(shape(_in_object(points, keyframe))) < FAR_M
            self._points.append(points[near])

    def misfit_m(self, shape: SDF) -> float:
        """Mean distance of the measurements from a shape, at the current poses; each at most 6 mm."""
        off = [
            np.minimum(np.abs(shape(_in_object(points, keyframe))), FAR_M)
            for keyframe, points in zip(self._frames, self._points, strict=True)
        ]
        return float(np.concatenate(off).mean())


def _in_object(points: NDArray[np.float64], keyframe: Keyframe) -> NDArray[np.float64]:
    return transform_points(inverse(keyframe.T_cam_obj), points)


# -- Learns the colours of object and background from keyframes, for a tracker without colour models


LAST = 20  # what came before, a tracker that has followed all of them has nearly forgotten


def learn_colors(tracker: Tracker, keyframes: list[Keyframe], camera: Camera, index: int) -> None:
    """Let a tracker with their shape learn from the last of `keyframes`; its pose must be set again afterwards."""
    colored = [s for s in keyframes if s.rgb is not None][-LAST:]
    TrackerInterface(tracker).relearn_colors(((frame_of(s, camera), s.T_cam_obj) for s in colored), index)
