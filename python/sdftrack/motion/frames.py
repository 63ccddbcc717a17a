# SPDX-License-Identifier: MIT
"""Trajectories made of others: of another point, in another frame, at regular times, filtered with zero phase."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, savgol_filter, sosfiltfilt
from scipy.spatial.transform import Rotation, Slerp

from sdftrack import geometry
from sdftrack._internal.validation import direction, number, vector, whole
from sdftrack.motion.posterior import checked_gap
from sdftrack.motion.repetitions import runs
from sdftrack.motion.spline import continuous_quaternions, matrices
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


def resample(trajectory: Trajectory, rate_hz: float, *, max_gap_s: float = 0.3) -> Trajectory:
    """The trajectory at regular times: positions by cubic splines, rotations by spherical interpolation.

    Between poses that are farther apart than `max_gap_s` the result is "lost"; it has no covariances.
    """
    rate, gap = number(rate_hz, "rate_hz"), checked_gap(max_gap_s)
    if not 0 < rate <= 10_000:
        raise ValueError(f"rate_hz: expected more than 0 and at most 10000, got {rate_hz!r}")
    used = np.flatnonzero(trajectory.usable)
    t, poses = trajectory.times_s[used], trajectory.poses[used]
    times = trajectory.times_s[0] + np.arange(int(trajectory.duration_s * rate + 1e-6) + 1) / rate
    out = np.full((len(times), 4, 4), np.nan)
    for part in np.split(np.arange(len(t)), np.flatnonzero(np.diff(t) > gap) + 1):
        inside = (times >= t[part[0]] - 1e-9) & (times <= t[part[-1]] + 1e-9)
        if len(part) < 2 or not inside.any():
            continue
        at = np.clip(times[inside], t[part[0]], t[part[-1]])
        out[inside] = np.eye(4)
        out[inside, :3, 3] = CubicSpline(t[part], poses[part, :3, 3])(at)
        rotations = Rotation.from_quat(continuous_quaternions(poses[part, :3, :3]))
        out[inside, :3, :3] = Slerp(t[part], rotations)(at).as_matrix()
    status = np.where(np.isfinite(out[:, 0, 0]), "ok", "lost").tolist()
    return dataclasses.replace(trajectory, times_s=times, poses=out, covariances=None, status=status)


def butterworth(trajectory: Trajectory, cutoff_hz: float = 6.0, order: int = 2) -> Trajectory:
    """Low pass of positions and quaternions, forwards and backwards (twice the order, zero phase).

    6 Hz is usual for reaching movements. The times must be regular (:func:`resample`).
    """
    rate = _regular(trajectory)
    cutoff = number(cutoff_hz, "cutoff_hz")
    if not 0 < cutoff < rate / 2:
        raise ValueError(f"cutoff_hz: expected 0 to half of the rate ({rate / 2:g} Hz), got {cutoff_hz:g}")
    sos = butter(whole(order, "order", 1, 10), cutoff, fs=rate, output="sos")
    return _filtered(trajectory, lambda x: sosfiltfilt(sos, x, axis=0), 3 * (2 * len(sos) + 1) + 1)


def savitzky_golay(trajectory: Trajectory, window_s: float = 0.3, degree: int = 4) -> Trajectory:
    """Local polynomials of `degree` over `window_s`. The times must be regular (:func:`resample`)."""
    rate = _regular(trajectory)
    degree = whole(degree, "degree", 0, 10)
    window = min(number(window_s, "window_s") * rate / 2, len(trajectory.times_s))  # all is no less than more
    length = 2 * round(window) + 1 if window > 0 else 0
    if length <= degree:
        raise ValueError(
            f"window_s: expected more than {degree / rate:g} s for degree {degree}, got {window_s:g}"
        )
    return _filtered(trajectory, lambda x: savgol_filter(x, length, degree, axis=0), length)


def _filtered(trajectory: Trajectory, apply: Callable[[Array], Array], least: int) -> Trajectory:
    """Every stretch without a gap on its own; those that are too short for the filter become gaps."""
    poses = np.full_like(trajectory.poses, np.nan)
    status = ["lost"] * len(trajectory)
    for a, b in runs(trajectory.usable):
        if b - a < least:
            continue
        q = apply(continuous_quaternions(trajectory.poses[a:b, :3, :3]))
        poses[a:b] = np.eye(4)
        poses[a:b, :3, :3] = matrices(q)
        poses[a:b, :3, 3] = apply(trajectory.poses[a:b, :3, 3])
        status[a:b] = list((trajectory.status or ())[a:b])
    if not np.isfinite(poses).any():
        raise ValueError(f"{trajectory.name}: expected at least {least} poses without a gap for this filter")
    return dataclasses.replace(trajectory, poses=poses, covariances=None, status=status)


def _regular(trajectory: Trajectory) -> float:
    steps = np.diff(trajectory.times_s)
    if len(steps) < 1 or np.ptp(steps) > 0.02 * np.median(steps):
        raise ValueError(f"{trajectory.name}: expected regular times; use st.motion.resample first")
    return trajectory.rate_hz
