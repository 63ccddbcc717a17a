# SPDX-License-Identifier: MIT
"""Filters of zero phase that movement science uses, without covariances and intervals."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, savgol_filter, sosfiltfilt
from scipy.spatial.transform import Rotation, Slerp

from sdftrack._internal.validation import number, whole
from sdftrack.motion.posterior import checked_gap
from sdftrack.motion.quaternion_curves import continuous_quaternions, matrices
from sdftrack.motion.repetitions import runs
from sdftrack.motion.trajectory import Trajectory

Array = NDArray[np.float64]


def resample(trajectory: Trajectory, rate_hz: float, *, max_gap_s: float = 0.3) -> Trajectory:
    """The trajectory at regular times: positions by cubic splines, rotations by spherical interpolation.

    Between poses that are farther apart than `max_gap_s` the result is "lost"; it has no covariances.
    """
    rate, gap = _rate(rate_hz), checked_gap(max_gap_s)
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


def _rate(rate_hz: float) -> float:
    rate = number(rate_hz, "rate_hz")
    if not 0 < rate <= 10_000:
        raise ValueError(f"rate_hz: expected more than 0 and at most 10000, got {rate_hz!r}")
    return rate
