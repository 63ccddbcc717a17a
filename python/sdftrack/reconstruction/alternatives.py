# SPDX-License-Identifier: MIT
"""Alternative poses that are consistent with a frame, for a shape that is only partly observed.

A search ranks poses by how well they explain a view, and prefers those that match previously observed surface. If a can
was observed from one side, its other end is a guess: upside down it looks the same, and the search finds the upright
pose. The decision is therefore not which pose fits best, but which poses are refuted by the frames.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry, metrics
from sdftrack.mesh import Mesh
from sdftrack.sdf import SDF

__all__ = ["another_pose", "turns"]

STEP_RAD = np.radians(30.0)
TRIED = 12  # of the turns, those that explain the measurements best
APART_RAD = np.radians(12.0)  # nearer than that to the pose found it is the same one
READINGS = 600
FAR_M = 0.01  # a measurement farther from the surface is not explained at all
POSSIBLE_M = 0.004  # mean distance of measurements, at most; a guess may be off by so much

Pose = NDArray[np.float64]
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
    mesh: Mesh,
    shape: SDF,
    read_cam: Points,
    settle: Callable[[Pose], Pose],
    refuted: Callable[[Pose], bool],
) -> Pose | None:
    """A pose far from the one found that also explains the measurements and is not refuted; None: there is none.

    Parameters
    ----------
    T_cam_obj : (4, 4)
        The pose found.
    mesh, shape
        Of the object, including its guessed parts.
    read_cam : (N, 3)
        The object's depth measurements, camera frame.
    settle
        Function that refines a pose to the best fit nearby.
    refuted
        Function that tells whether the frame contradicts a pose.
    """
    some = read_cam[:: max(1, len(read_cam) // READINGS)]

    def misfit_m(T: Pose) -> float:
        off = np.abs(shape(geometry.transform_points(geometry.inverse(T), some)))
        return float(np.minimum(off, FAR_M).mean())

    tried = sorted((T_cam_obj @ turn for turn in turns(mesh)), key=misfit_m)[:TRIED]
    for T in map(settle, tried):
        if not np.isfinite(T).all() or metrics.pose_error(T, T_cam_obj)[1] < APART_RAD:
            continue
        if misfit_m(T) < POSSIBLE_M and not refuted(T):
            return T
    return None
