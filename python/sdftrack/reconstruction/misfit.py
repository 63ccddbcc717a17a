# SPDX-License-Identifier: MIT
"""Misfit between a shape with its poses and the depth measurements, used to judge a refinement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.geometry import inverse, transform_points
from sdftrack.reconstruction.keyframe import Keyframe
from sdftrack.sdf import SDF

__all__ = ["OVERFIT", "Judge"]

# A shape that grew with its poses has taken over some of their frames' errors: what is right may fit so much worse.
OVERFIT = 1.01
FAR_M = 0.006  # a measurement farther from the surface is another thing's, or as wrong as can be
FRAMES, READINGS = 60, 1500  # that are looked at: of all frames, and of each


class Judge:
    """A fixed sample of the object's depth measurements, selected with the current shape.

    The same measurements judge every later shape and set of poses, so that none scores better by explaining less.
    """

    def __init__(self, keyframes: list[Keyframe], shape: SDF, camera: Camera) -> None:
        self._frames = keyframes[:: max(1, len(keyframes) // FRAMES)]
        self._points = []
        for keyframe in self._frames:
            points = _read_points(keyframe, camera)
            near = np.abs(shape(_in_object(points, keyframe))) < FAR_M
            self._points.append(points[near])

    def misfit_m(self, shape: SDF) -> float:
        """Mean distance of the measurements from a shape, at the current poses; each at most 6 mm."""
        off = [
            np.minimum(np.abs(shape(_in_object(points, keyframe))), FAR_M)
            for keyframe, points in zip(self._frames, self._points, strict=True)
        ]
        return float(np.concatenate(off).mean())


def _read_points(keyframe: Keyframe, camera: Camera) -> NDArray[np.float64]:
    """(N, 3) points in the camera frame."""
    points = camera.back_project(keyframe.full_depth(camera.height, camera.width))
    read: NDArray[np.float64] = points[points[..., 2] > 0]
    return read[:: max(1, len(read) // READINGS)]


def _in_object(points: NDArray[np.float64], keyframe: Keyframe) -> NDArray[np.float64]:
    return transform_points(inverse(keyframe.T_cam_obj), points)
