# SPDX-License-Identifier: MIT
"""Other poses that a frame leaves possible for a shape of which a part is only guessed.

A search compares how well poses explain a view, and prefers those that put it on surface that was seen. A can that was
seen from one side has its other end as a guess: standing on its head it looks as before, and the search finds it not
turned. What decides is therefore not which pose fits best but which of them the frames refute.
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
TRIED = 12  # of the turns, those that explain the readings best
APART_RAD = np.radians(12.0)  # nearer than that to the pose found it is the same one
READINGS = 600
FAR_M = 0.01  # a reading farther from the surface is not explained at all
POSSIBLE_M = 0.004  # mean distance of readings, at most; a guess may be off by so much

Pose = NDArray[np.float64]
Points = NDArray[np.float64]


def turns(mesh: Mesh) -> list[Pose]:
    """Turns (4, 4) of the object frame about a mesh's axes of inertia, by steps of 30 degrees, upright and overhead."""
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
    """A pose far from the one found that explains the readings, too, and that nothing refutes; None: there is none.

    Parameters
    ----------
    T_cam_obj : (4, 4)
        The pose found.
    mesh, shape
        Of the object, its guessed parts included.
    read_cam : (N, 3)
        The object's readings, camera frame.
    settle
        A pose near the one given that explains the frame best.
    refuted
        Whether the frame speaks against a pose.
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
