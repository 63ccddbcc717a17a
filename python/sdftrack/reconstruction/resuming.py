# SPDX-License-Identifier: MIT
"""A known shape found in the first frame of another recording, and whether what is seen there can be it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.geometry import inverse, transform_points
from sdftrack.imaging.pose_hint import Place
from sdftrack.mesh import Mesh
from sdftrack.reconstruction.first_view import FirstView, planes_below
from sdftrack.reconstruction.initialization import Beginning, ball_of, find_object
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.results import Status, TrackResult
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker

__all__ = ["Contradiction", "contradiction", "look_for", "shown_in"]

NEAR_M = 0.006  # a reading farther before the surface is another thing's, if it is in space that was seen to be empty
BEHIND_M = 0.010  # a reading farther behind the surface has looked through it
EMPTY_FRAMES, EMPTY_RATIO = 3.0 / 2.94, -1.5  # as in cpp/reconstruction/reconstruction.cpp: three frames looked past
MOST_EMPTY, MOST_THROUGH = 0.1, 0.1  # shares that a right pose may have, by noise and by what the mask errs
LEAST_PIXELS = 100

Pose = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Contradiction:
    """How much of a frame speaks against a pose of the shape as it is known.

    Attributes
    ----------
    empty : float
        Of the object's readings, the share in space that frames before have seen to be empty.
    through : float
        Of the surface that was seen before and faces the camera, the share that the frame looks through.
    """

    empty: float
    through: float

    @property
    def reason(self) -> str:
        """One sentence; empty: nothing speaks against the pose."""
        if self.empty > MOST_EMPTY:
            return (
                f"{100 * self.empty:.0f} % of what is seen lies where the object was seen not to be; give a tighter mask, "
                "or another frame"
            )
        if self.through > MOST_THROUGH:
            return (
                f"{100 * self.through:.0f} % of the known surface should be seen and is not there; give another frame"
            )
        return ""


def shown_in(
    frame: Frame, place: Place, camera: Camera, shape: SDF, options: ReconstructorOptions
) -> Beginning:
    """What the first frame of another recording shows of the object: by a mask or a box as at the first start.

    With a pose the object's pixels are those of its silhouette; no outline is known then, but the planes are.
    """
    assert frame.depth is not None
    posed = isinstance(place, np.ndarray) and place.shape == (4, 4)
    found = find_object(frame.depth, place, camera, shape if posed else None, options)
    if posed and options.planes:
        ball = ball_of(frame.depth, found.on_object, camera)
        planes = planes_below(frame.depth, found.on_object, camera, 2 * ball.radius_m)
        anywhere = np.zeros((camera.height, camera.width), np.float32)
        found = replace(found, view=FirstView(anywhere, planes))
    return found


def look_for(tracker: Tracker, frame: Frame, place: Place, on_object: Mask) -> TrackResult:
    """Where the tracker's shape is: at the pose given or near it, else by a search on the object's pixels."""
    if isinstance(place, np.ndarray) and place.shape == (4, 4):
        return tracker.start(frame, poses=place)
    return tracker.start(frame, masks=on_object)


def contradiction(
    core: Any, mesh: Mesh, least_seen: float, frame: Frame, on_object: Mask, camera: Camera, T_cam_obj: Pose
) -> Contradiction:
    """What a frame says against the shape at a pose; `mesh` is its surface, with `seen`."""
    assert frame.depth is not None
    points = camera.back_project(frame.depth)[on_object & (frame.depth > 0)]
    p_obj = transform_points(inverse(T_cam_obj), points)
    voxel = np.round((p_obj - core.origin) / core.voxel_m).astype(np.intp)
    within = ((voxel >= 0) & (voxel < core.voxels)).all(axis=1)
    x, y, z = voxel[within].T
    weight = core.weight[z, y, x]
    empty = (
        (core.phi[z, y, x] > NEAR_M)
        & (weight > EMPTY_FRAMES)
        & (core.log_ratio[z, y, x] < EMPTY_RATIO * weight)
    )
    through = _looked_through(mesh, least_seen, frame.depth, camera, T_cam_obj)
    return Contradiction(float(np.sum(empty) / max(1, len(points))), through)


def _looked_through(
    mesh: Mesh, least_seen: float, depth: NDArray[np.float32], camera: Camera, T_cam_obj: Pose
) -> float:
    from sdftrack.reconstruction.quality import seen_part

    part = seen_part(mesh, least_seen)
    if len(part.faces) == 0:
        return 0.0
    whole_m, part_m = (m.raycast(camera, T_cam_obj)[0] for m in (mesh, part))
    # What lies behind a hole in the seen part is its far side, which the camera need not see.
    known = (part_m > 0) & (np.abs(part_m - whole_m) < 1e-4) & (depth > 0)
    if np.count_nonzero(known) < LEAST_PIXELS:
        return 0.0
    return float(np.mean(depth[known] > part_m[known] + BEHIND_M))


def told(result: TrackResult, reason: str) -> TrackResult:
    """The result with its only object doubted for a reason."""
    confidence = np.minimum(result.confidence, 0.5)
    confidence.flags.writeable = False
    return replace(result, status=[Status.WEAK], reason=[reason], confidence=confidence)
