# SPDX-License-Identifier: MIT
"""Trajectories of another point of the object, and in another frame: the table's, or a chosen one."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import geometry
from sdftrack._internal.validation import direction, number, vector
from sdftrack.motion.trajectory import Trajectory

Array = NDArray[np.float64]
COST_RAD = 0.02  # a point 10 mm away is taken if its position is known by more than 0.2 mm better


def at_point(trajectory: Trajectory, point_obj_m: ArrayLike) -> Trajectory:
    """The trajectory of the object frame moved to a point of the object, for example its centre.

    Positions, their covariances and all measures of them are then those of this point. Of an object that looks the same
    from all sides only the centre has a known position.

    Parameters
    ----------
    trajectory : Trajectory
    point_obj_m : (3,) array
        In the object frame, m.
    """
    point = vector(point_obj_m, "point_obj_m")
    poses = trajectory.poses.copy()
    lever = poses[:, :3, :3] @ point
    poses[:, :3, 3] += lever
    covariances = trajectory.covariances
    if covariances is not None:
        J = np.tile(np.eye(6), (len(poses), 1, 1))
        J[:, :3, 3:] = -_cross_matrices(lever)  # Exp(r) lever = lever + r x lever
        covariances = J @ covariances @ np.swapaxes(J, 1, 2)
    return dataclasses.replace(trajectory, poses=poses, covariances=covariances)


def best_known_point(trajectory: Trajectory, near_obj_m: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """The point of the object whose position is known best, as near to `near_obj_m` as that allows.

    Of an object that looks alike from several sides only points on its axis, or its centre, have a known position: a
    rotation that nobody sees moves all others. Without covariances it is `near_obj_m`.

    Parameters
    ----------
    trajectory : Trajectory
    near_obj_m : (3,) array
        For example the middle of the model, object frame, m.

    Returns
    -------
    (3,) float64
        For :func:`at_point`.
    """
    near = vector(near_obj_m, "near_obj_m")
    if trajectory.covariances is None:
        return near
    used = trajectory.usable & np.isfinite(trajectory.covariances).all(axis=(1, 2))
    R, C = trajectory.poses[used, :3, :3], trajectory.covariances[used]
    # The error of a point x is d + sum over i of x_i M_i r, with the errors d of the origin and r of the rotation.
    M = np.stack([-_cross_matrices(R[:, :, i]) for i in range(3)], axis=1)
    A = np.einsum("niab,nbc,njac->nij", M, C[:, 3:, 3:], M).mean(axis=0)
    b = np.einsum("niab,nba->ni", M, C[:, 3:, :3]).mean(axis=0)
    return np.asarray(np.linalg.solve(A + COST_RAD**2 * np.eye(3), COST_RAD**2 * near - b))


def in_frame(trajectory: Trajectory, T_frame_ref: ArrayLike, name: str) -> Trajectory:
    """The trajectory in another frame that does not move.

    Parameters
    ----------
    trajectory : Trajectory
        In a frame `ref`, for example the camera's.
    T_frame_ref : (4, 4) array
        From that frame to the new one.
    name : str
        Of the new frame.
    """
    T = geometry.rigid(T_frame_ref, "T_frame_ref")
    covariances = trajectory.covariances
    if covariances is not None:
        J = np.kron(np.eye(2), T[:3, :3])
        covariances = J @ covariances @ J.T
    return dataclasses.replace(trajectory, poses=T @ trajectory.poses, covariances=covariances, frame=name)


def table_frame(normal: ArrayLike, offset_m: float) -> Array:
    """T_table_cam (4, 4) of a table n . p + d = 0 found by :func:`sdftrack.remove_plane`.

    z points up from the table, y away from the camera, x to the right as the camera sees it; the origin is where the
    optical axis meets the table, or, if it does not, below the camera.
    """
    z = direction(normal, "normal")
    d = number(offset_m, "offset_m") / float(np.linalg.norm(normal))
    if not np.isfinite(d):
        raise ValueError(f"offset_m: expected a finite number, got {offset_m}")
    if d < 0:  # the camera is above the table
        z, d = -z, -d
    ahead = np.array([0.0, 0.0, 1.0]) - z[2] * z
    if np.linalg.norm(ahead) < 1e-6:  # looking straight down: up in the image is away
        ahead = np.array([0.0, -1.0, 0.0])
    y = ahead / np.linalg.norm(ahead)
    R = np.array([np.cross(y, z), y, z])
    meets = -d / z[2] if z[2] < -0.05 else None
    origin = np.array([0.0, 0.0, meets]) if meets is not None else -d * z
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, -R @ origin
    return T


def _cross_matrices(v: Array) -> Array:
    """(n, 3, 3) matrices of the cross product with vectors (n, 3)."""
    x, y, z = v.T
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
