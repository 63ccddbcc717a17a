# SPDX-License-Identifier: MIT
"""Finds a known shape in the first frame of another recording, and checks consistency with the frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core, geometry, metrics
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.geometry import inverse, transform_points
from sdftrack.imaging.pose_hint import Place
from sdftrack.mesh import Mesh
from sdftrack.reconstruction.arguments import find_object, find_standing
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.reconstruction.quality import seen_part
from sdftrack.results import Status, TrackResult, doubted
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker
from sdftrack.tracking.interface import TrackerInterface

NEAR_M = 0.006  # a measurement farther in front of the surface, in space seen to be free, is another object's
BEHIND_M = 0.010  # a measurement farther behind the surface contradicts it
# As in cpp/reconstruction/reconstruction.cpp: three frames have looked past.
EMPTY_FRAMES, EMPTY_RATIO = 3.0 / 2.94, -1.5
MAX_EMPTY, MAX_THROUGH = 0.1, 0.1  # shares that a right pose may have, by noise and by what the mask errs
WORSE = 0.025  # of a frame, that speaks against another pose more than against the one found, refutes it
MIN_PIXELS, SAME_M = 100, 1e-4
AMBIGUOUS = (
    "ambiguous: rotated by {:.0f} deg it is equally consistent with the observations; show a distinctive side, or "
    "give the pose"
)

Pose = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Contradiction:
    """Evidence of a frame against a pose of the known shape."""

    # `empty`: fraction of the object's measurements in space observed to be free by earlier frames. `through`: fraction
    # of the previously observed, camera-facing surface where the frame observes free space.

    empty: float
    through: float

    @property
    def total(self) -> float:
        return self.empty + self.through

    @property
    def reason(self) -> str:
        """One sentence; empty: no contradiction."""
        if self.empty > MAX_EMPTY:
            return (
                f"{100 * self.empty:.0f} % of the measurements lie in space observed to be free; give a tighter "
                "mask, or another frame"
            )
        if self.through > MAX_THROUGH:
            return f"{100 * self.through:.0f} % of the known surface should be visible and is not; give another frame"
        return ""


def begin_again(
    tracker: Tracker,
    shape: SDF,
    mesh: Mesh,
    core: Any,
    frame: Frame,
    place: Place,
    camera: Camera,
    options: ReconstructorOptions,
) -> tuple[TrackResult, _core.Beginning | None]:
    """Start a tracker that has the known shape in the first frame of another recording."""
    # Returns bounds on the object from that frame, too, at the pose found; None: the pose is not reliable.
    assert frame.depth is not None
    if isinstance(place, np.ndarray) and place.shape == (4, 4):
        result = _settled(tracker, tracker.start(frame, poses=place))
        if result.status[0] is not Status.OK:
            return result, None
        shown = find_standing(frame, np.array(result.poses[0]), camera, shape, options)
        looked = Looked(core, mesh, options.min_seen, frame, shown.on_object, camera)
    else:
        shown = find_object(frame, place, camera, None, options)
        looked = Looked(core, mesh, options.min_seen, frame, shown.on_object, camera)
        result = _find_known(tracker, shape, looked, frame, shown.on_object)
    if result.status[0] is Status.OK and (reason := looked.against(result.poses[0]).reason):
        result = doubted(result, reason)
    return _at_pose(result, shown)


def begin_with(
    tracker: Tracker, frame: Frame, place: Place, camera: Camera, options: ReconstructorOptions
) -> tuple[TrackResult, _core.Beginning | None]:
    """As `begin_again`, with a tracker's own shape, whose observed parts are unknown."""
    assert frame.depth is not None
    if isinstance(place, np.ndarray) and place.shape == (4, 4):
        result, shown = tracker.start(frame, poses=place), None
        if result.status[0] is Status.OK:
            shown = find_standing(frame, np.array(result.poses[0]), camera, tracker.shapes[0], options)
    else:
        shown = find_object(frame, place, camera, None, options)
        result = tracker.start(frame, masks=shown.on_object)
    return _at_pose(result, shown)


def _at_pose(
    result: TrackResult, shown: _core.Beginning | None
) -> tuple[TrackResult, _core.Beginning | None]:
    if shown is None or result.status[0] is not Status.OK:
        return result, None
    return result, shown.at_pose(np.array(result.poses[0]))


def _settled(tracker: Tracker, result: TrackResult) -> TrackResult:
    """Turns that the frame alone leaves open are no objection, nor doubt: other poses are compared here."""
    seen = TrackerInterface(tracker)
    if not seen.is_sure(0):
        return result
    confidence = np.maximum(result.confidence, seen.evidence(0))
    return replace(result, status=[Status.OK], reason=[""], confidence=confidence)


class Looked:
    """Compares a frame of another recording with the known shape; `mesh` is its surface, with `seen`."""

    def __init__(
        self, core: Any, mesh: Mesh, min_seen: float, frame: Frame, on_object: Mask, camera: Camera
    ) -> None:
        assert frame.depth is not None
        self.mesh, self._part = mesh, seen_part(mesh, min_seen)
        self._core, self._camera, self._depth = core, camera, frame.depth
        self.read_cam: NDArray[np.float64] = camera.back_project(frame.depth)[on_object & (frame.depth > 0)]

    def against(self, T_cam_obj: Pose) -> Contradiction:
        """Evidence of the frame against a pose."""
        return Contradiction(self._in_empty_space(T_cam_obj), self._looked_through(T_cam_obj))

    def _in_empty_space(self, T_cam_obj: Pose) -> float:
        core = self._core
        p_obj = transform_points(inverse(T_cam_obj), self.read_cam)
        voxel = np.round((p_obj - core.origin) / core.voxel_m).astype(np.intp)
        x, y, z = voxel[((voxel >= 0) & (voxel < core.voxels)).all(axis=1)].T
        weight = core.weight[z, y, x]
        empty = (core.phi[z, y, x] > NEAR_M) & (weight > EMPTY_FRAMES)
        empty &= core.log_ratio[z, y, x] < EMPTY_RATIO * weight
        return float(np.sum(empty) / max(1, len(p_obj)))

    def _looked_through(self, T_cam_obj: Pose) -> float:
        if len(self._part.faces) == 0:
            return 0.0
        whole_m, part_m = (m.raycast(self._camera, T_cam_obj)[0] for m in (self.mesh, self._part))
        # What lies behind a hole in the seen part is its far side, which the camera need not see.
        known = (part_m > 0) & (np.abs(part_m - whole_m) < SAME_M) & (self._depth > 0)
        if np.count_nonzero(known) < MIN_PIXELS:
            return 0.0
        return float(np.mean(self._depth[known] > part_m[known] + BEHIND_M))


def _find_known(tracker: Tracker, shape: SDF, looked: Looked, frame: Frame, on_object: Mask) -> TrackResult:
    """Search for the tracker's shape in the object's pixels; weak if another pose is possible too."""
    result = _settled(tracker, tracker.start(frame, masks=on_object))
    if result.status[0] is not Status.OK:
        return result
    alternatives = TrackerInterface(tracker).alternative_poses(0)
    found = np.array(result.poses[0])
    most = looked.against(found).total + WORSE
    other = another_pose(
        found, alternatives, looked.mesh, shape, looked.read_cam,
        lambda T: np.array(tracker.start(frame, poses=T).poses[0]), lambda T: looked.against(T).total > most,
    )  # fmt: skip
    if other is not None:
        turned = np.degrees(metrics.pose_error(other, found)[1])
        return doubted(result, AMBIGUOUS.format(turned))
    return _settled(tracker, tracker.start(frame, poses=found))  # back from what was tried


# -- Alternative poses that are consistent with a frame, for a shape that is only partly observed


STEP_RAD = np.radians(30.0)
TRIED = 12  # of the turns, those that explain the measurements best
APART_RAD = np.radians(12.0)  # nearer than that to the pose found it is the same one
READINGS = 600
FAR_M = 0.01  # a measurement farther from the surface is not explained at all
POSSIBLE_M = 0.004  # mean distance of measurements, at most; a guess may be off by so much

Points = NDArray[np.float64]


def turns(mesh: Mesh) -> list[Pose]:
    """Rotations (4, 4) of the object frame about a mesh's axes of inertia, every 30 degrees, upright and inverted."""
    corner = mesh.vertices[mesh.faces]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    middles = corner.mean(axis=1)
    middle = np.average(middles, axis=0, weights=area)
    _, axes = np.linalg.eigh(np.cov((middles - middle).T, aweights=area))
    out = []
    for k in range(3):
        about, across = axes[:, k], axes[:, (k + 1) % 3]
        for over in (0.0, np.pi):
            flip = geometry.pose(over * across, np.zeros(3))
            for n in range(round(2 * np.pi / STEP_RAD)):
                R = geometry.pose(n * STEP_RAD * about, np.zeros(3)) @ flip
                if n or over:
                    R[:3, 3] = middle - R[:3, :3] @ middle
                    out.append(R)
    return out


def another_pose(
    T_cam_obj: Pose,
    alternatives: NDArray[np.float64],
    mesh: Mesh,
    shape: SDF,
    read_cam: Points,
    settle: Callable[[Pose], Pose],
    refuted: Callable[[Pose], bool],
) -> Pose | None:
    """A pose far from the one found that also explains the measurements `read_cam` (N, 3); None: there is none."""
    # Tried are turns about the mesh's axes and the `alternatives` (n, 4, 4). `settle` refines a pose to the best fit
    # nearby, `refuted` tells whether the frame contradicts it. `mesh` and `shape` include the object's guessed parts.
    some = read_cam[:: max(1, len(read_cam) // READINGS)]

    def misfit_m(T: Pose) -> float:
        off = np.abs(shape(geometry.transform_points(geometry.inverse(T), some)))
        return float(np.minimum(off, FAR_M).mean())

    tried = sorted((T_cam_obj @ turn for turn in turns(mesh)), key=misfit_m)[:TRIED]
    for T in map(settle, [*alternatives, *tried]):
        if not np.isfinite(T).all() or metrics.pose_error(T, T_cam_obj)[1] < APART_RAD:
            continue
        if misfit_m(T) < POSSIBLE_M and not refuted(T):
            return T
    return None
