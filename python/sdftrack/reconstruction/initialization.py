# SPDX-License-Identifier: MIT
"""Finds an unknown object in its first frame; the options of the thesis' tracker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.imaging.pose_hint import Place
from sdftrack.options import TrackerOptions
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.sdf import SDF

Array = NDArray[np.float64]


def find_object(
    depth: NDArray[np.float32],
    place: Place,
    camera: Camera,
    initial: SDF | None,
    options: ReconstructorOptions,
) -> _core.Beginning:
    """The object at a mask, a box, or the pose of the initial shape (see `sdftrack.imaging.pose_hint`)."""
    shape = None if initial is None else initial._core_args
    return _core.find_object(depth, place, camera._core, shape, *_limits(options))


def find_standing(
    depth: NDArray[np.float32], pose: Array, camera: Camera, shape: SDF, options: ReconstructorOptions
) -> _core.Beginning:
    """The object's pixels at the pose of a shape, whose outline is unknown, with the planes that it stands on."""
    return _core.find_standing(depth, pose, camera._core, shape._core_args, *_limits(options))


def _limits(options: ReconstructorOptions) -> tuple[bool, bool, int, float | None]:
    return options.planes, options.keep_to_mask, options.mask_margin_px, options.noise_m


def printed_tracker_options() -> TrackerOptions:
    """Options of the thesis' tracker, which does not assess its poses."""
    return TrackerOptions.printed().replace(
        lost_inliers=0.0, weak_inliers=0.0, lost_evidence=0.0, weak_evidence=0.0
    )
