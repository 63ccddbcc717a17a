# SPDX-License-Identifier: MIT
"""The poses of one object over time, with their covariances and statuses."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import numbers

Array = NDArray[np.float64]
MAX_REACH_M = 100.0  # a path beyond this is one in millimetres: no depth camera sees so far
USABLE = ("ok", "weak")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The poses of one object over time.

    Parameters
    ----------
    times_s : (N,) array
        Timestamps in seconds, strictly increasing.
    poses : (N, 4, 4) array
        T_ref_obj in metres. The reference frame is the camera's unless `frame` says otherwise.
    covariances : (N, 6, 6) array, optional
        Of (x, y, z, rx, ry, rz) in m and rad, as `TrackResult.covariances`: axes of the reference frame, about the
        object's origin. None or NaN: unknown; the noise is then estimated from the trajectory itself.
    status : sequence of str, optional
        "ok", "weak", "lost" or "bad_frame" per pose; None: all "ok". Poses of lost objects and bad frames are not used.
    name : str
        Name of the object.
    frame : str
        Name of the reference frame.

    Attributes
    ----------
    usable : (N,) bool
        Frames with a pose that was measured: "ok" or "weak", finite.

    Raises
    ------
    TypeError, ValueError
        Wrong shapes, no pose, times that do not increase, poses that are not rigid or that are farther than 100 m.
    """

    times_s: Array
    poses: Array
    covariances: Array | None = None
    status: Sequence[str] | None = None
    name: str = "object"
    frame: str = "camera"

    def __post_init__(self) -> None:
        times = numbers(self.times_s, "times_s")
        poses = numbers(self.poses, "poses")
        covariances = None if self.covariances is None else numbers(self.covariances, "covariances")
        if times.ndim != 1 or not len(times):
            raise ValueError(f"times_s: expected one time per pose, at least one, got shape {times.shape}")
        for name, array, side in (("poses", poses, 4), ("covariances", covariances, 6)):
            shape = (len(times), side, side)
            if array is not None and array.shape != shape:
                raise ValueError(f"{name}: expected shape {shape}, as times_s, got {array.shape}")
        if covariances is not None and not np.isfinite(covariances).any():
            covariances = None
        status = [str(s) for s in self.status] if self.status is not None else ["ok"] * len(times)
        if len(status) != len(times):
            raise ValueError(f"status: expected {len(times)} of them, as times_s, got {len(status)}")
        _check_times(times)
        usable = np.isin(status, USABLE) & np.isfinite(poses).all(axis=(1, 2))
        if not usable.any():
            raise ValueError(
                f"{self.name}: expected at least one pose, but the object is lost in all {len(times)} frames"
            )
        _check_poses(poses[usable], self.name)
        for field, value in (
            ("times_s", times),
            ("poses", poses),
            ("covariances", covariances),
            ("status", tuple(status)),
            ("usable", usable),
        ):
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, field, value)

    usable: NDArray[np.bool_] = dataclasses.field(init=False, repr=False)

    def __len__(self) -> int:
        return len(self.times_s)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame, s."""
        return float(self.times_s[-1] - self.times_s[0])

    @property
    def rate_hz(self) -> float:
        """Frames per second: the inverse of the median time between frames; NaN for one frame."""
        return 1.0 / float(np.median(np.diff(self.times_s))) if len(self) > 1 else float("nan")

    def part(self, chosen: slice | ArrayLike) -> Trajectory:
        """The frames of a slice or mask."""
        index = np.arange(len(self))[chosen if isinstance(chosen, slice) else np.asarray(chosen)]
        return dataclasses.replace(
            self,
            times_s=self.times_s[index],
            poses=self.poses[index],
            covariances=None if self.covariances is None else self.covariances[index],
            status=[str(self.status[i]) for i in index] if self.status is not None else None,
        )


def _check_times(times: Array) -> None:
    if not np.isfinite(times).all():
        raise ValueError("times_s: expected finite times; a recording without them needs fps (--fps)")
    steps = np.diff(times)
    if (steps <= 0).any():
        i = int(np.argmax(steps <= 0))
        what = "repeated" if steps[i] == 0 else "not sorted"
        raise ValueError(
            f"times_s: expected strictly increasing times, but they are {what} at frames {i} and {i + 1} "
            f"({times[i]:.6f} s, {times[i + 1]:.6f} s); sort the rows and remove repeated ones, or give fps (--fps)"
        )


def _check_poses(poses: Array, name: str) -> None:
    R = poses[:, :3, :3]
    error = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max()
    if error > 0.01 or (np.linalg.det(R) < 0).any():
        raise ValueError(
            f"{name}: expected rigid poses, but a rotation matrix is not one (R^T R - I is {error:.2g})"
        )
    far = np.linalg.norm(poses[:, :3, 3], axis=1)
    if far.max() > MAX_REACH_M:
        raise ValueError(
            f"{name}: expected positions in metres, but one is {far.max():g} m from the origin; in mm? "
            "Divide by 1000 (--unit mm)"
        )
