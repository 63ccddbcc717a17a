# SPDX-License-Identifier: MIT
"""Tracking of a sequence, and errors against the ground truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.results import TrackResult

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Errors:
    """Errors of one object over N frames.

    Attributes
    ----------
    translation_m, rotation_rad : (N,) float64
    offset_m : (N, 3) float64
        Estimate minus truth, camera axes.
    turn_rad : (N,) float64
        Rotation about the given axis; ``rotation_rad`` is then the remainder (the angle between the axes). Zero without
        an axis.
    """

    translation_m: Array
    rotation_rad: Array
    offset_m: Array
    turn_rad: Array

    def __len__(self) -> int:
        return len(self.translation_m)


def swing_and_turn(R: Array, axis: Array) -> tuple[float, float]:
    """Split a rotation (object frame) into the tilt of `axis` and the rotation about it, both rad."""
    axis = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    turned = R @ axis
    swing = float(np.arctan2(np.linalg.norm(np.cross(axis, turned)), axis @ turned))
    # Undo the tilt by the smallest rotation that does; what is left turns about the axis.
    v = np.cross(turned, axis)
    V = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    rest = (np.eye(3) + V + V @ V / max(1e-12, 1.0 + float(axis @ turned))) @ R
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    turn = abs(float(np.arctan2(np.cross(across, rest @ across) @ axis, across @ rest @ across)))
    return swing, turn


def pose_errors(
    poses: Array, truth: Array, axis: Array | None = None, turns: Iterable[Array] | None = None
) -> Errors:
    """Errors of ``(N, 4, 4)`` estimates against ``(N, 4, 4)`` truth.

    With `axis` (object frame), the rotation about it is reported separately. `turns` are (4, 4) object-frame motions
    that leave the object (nearly) unchanged: the smallest error over them is used.
    """
    poses, truth = np.asarray(poses, np.float64), np.asarray(truth, np.float64)
    group = [np.eye(4)] if turns is None else list(turns)
    rows = []
    for T, T_true in zip(poses, truth, strict=True):
        candidates = [_one_error(T, T_true @ S, axis) for S in group]
        rows.append(min(candidates, key=lambda row: (row[1], row[0])))
    columns = list(zip(*rows, strict=True)) if rows else [(), (), (), ()]
    return Errors(
        np.array(columns[0], np.float64),
        np.array(columns[1], np.float64),
        np.array(columns[2], np.float64).reshape(-1, 3),
        np.array(columns[3], np.float64),
    )


def _one_error(T: Array, T_true: Array, axis: Array | None) -> tuple[float, float, Array, float]:
    from sdftrack.metrics import pose_error

    metres, radians = pose_error(T, T_true)
    turn = 0.0
    if axis is not None:
        radians, turn = swing_and_turn(T_true[:3, :3].T @ T[:3, :3], axis)
    return float(metres), float(radians), T[:3, 3] - T_true[:3, 3], float(turn)


def track_frames(
    tracker: Any,
    frames: Iterable[Any],
    start_poses: list[Array] | None,
    progress: Callable[[int, TrackResult], None] | None = None,
    start_options: Mapping[str, Any] | None = None,
) -> list[TrackResult]:
    """Start on the first frame, track through the rest; one result per frame."""
    results: list[TrackResult] = []
    for i, frame in enumerate(frames):
        if i == 0:
            result = tracker.start(frame, poses=start_poses, **(start_options or {}))
        else:
            result = tracker.track(frame)
        results.append(result)
        if progress is not None:
            progress(i, result)
    return results
