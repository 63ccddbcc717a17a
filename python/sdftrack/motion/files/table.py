# SPDX-License-Identifier: MIT
"""What a file says of an object; trajectories as CSV with one row per object and frame, which loses nothing."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import RotationErrors, quaternion, rigid_pose, rotation
from sdftrack._internal.text_files import cell_text, named, text_cell
from sdftrack._internal.validation import shown
from sdftrack.motion.trajectory import USABLE, Trajectory
from sdftrack.results import Status

Array = NDArray[np.float64]


@dataclass
class Record:
    """One object of a file; lengths in the unit of the file, NaN in gaps."""

    name: str
    times_s: Array
    poses: Array
    status: list[str]
    covariances: Array | None = None
    frame: str = "camera"


def quaternions_as_poses(positions: Array, quaternions: Array, place: Callable[[int], str]) -> Array:
    """(N, 4, 4) poses of (N, 3) positions and (N, 4) quaternions (x, y, z, w); rows that are not finite become NaN."""
    # `place` says where row i stands, for errors.
    poses = np.full((len(positions), 4, 4), np.nan)
    known = np.isfinite(positions).all(axis=1) & np.isfinite(quaternions).all(axis=1)
    for i in np.flatnonzero(known).tolist():
        if not quaternions[i].any():
            raise ValueError(
                f"{place(i)}: the quaternion is 0, which is no rotation; write nan where there is no pose"
            )
        poses[i] = np.eye(4)
        with named(place(i)):
            poses[i, :3, :3], poses[i, :3, 3] = rotation(quaternions[i]), positions[i]
    return poses


def matrices_as_poses(matrices: Array, place: Callable[[int], str]) -> Array:
    """(N, 4, 4) poses with the nearest rotations; those that are not finite become NaN."""
    # Files round: the rotations of single precision, or of a few digits, are orthogonal to that accuracy only.
    poses = np.full_like(matrices, np.nan)
    errors = RotationErrors()
    for i in np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2))).tolist():
        poses[i] = rigid_pose(matrices[i], place(i), errors)
    errors.tell(stacklevel=5)
    return poses


def gaps_as_lost(poses: Array, status: Sequence[str] | None = None) -> list[str]:
    """`status`, or "ok", of each pose, and "lost" where there is none, whatever the status says."""
    known = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
    return [
        given if pose or given not in USABLE else "lost"
        for pose, given in zip(known, status or ["ok"] * len(poses), strict=True)
    ]


def times_from_numbers(numbers: Any, fps: float | None, why: str) -> Array:
    """Times in seconds of numbered images; ValueError without `fps`, where `why` says what is missing."""
    if fps is None:
        raise ValueError(f"{why}; expected the frame rate: fps=30")
    return np.asarray(numbers, np.float64) / fps


TIMER_S = 1e-6  # files with times of six decimals
JITTER = 1e-3  # of a step


def shared_times(trajectories: Sequence[Trajectory], suffix: str) -> Array:
    """The times of all trajectories; ValueError if they differ."""
    first = trajectories[0]
    for t in trajectories[1:]:
        if not np.array_equal(t.times_s, first.times_s):
            raise ValueError(
                f"trajectories: a {suffix} file has one time for all objects, but {t.name!r} has other times than "
                f"{first.name!r}; resample them to common times, or save one file each"
            )
    return first.times_s


def regular_rate_hz(times_s: Array, suffix: str) -> float:
    """Frames per second; ValueError unless all steps are equal, to 0.1 % of a step and a microsecond."""
    if len(times_s) < 2:
        raise ValueError(f"trajectories: a {suffix} file has a frame rate, which takes two frames, got one")
    step = float(times_s[-1] - times_s[0]) / (len(times_s) - 1)
    error = np.abs(times_s - times_s[0] - step * np.arange(len(times_s)))
    if error.max() > JITTER * step + TIMER_S:
        i = int(error.argmax())
        raise ValueError(
            f"trajectories: a {suffix} file has one frame rate, but the times are irregular (frame {i} is "
            f"{1e3 * error[i]:.3g} ms off a rate of {1 / step:.4g} Hz); resample them first"
        )
    return 1 / step


TITLE = "# sdftrack trajectories"
HEADER = (
    f"{TITLE}, version 1: pose of each object in its reference frame (T_ref_obj)",
    "# m, s; quaternion x y z w; covariance of (x, y, z, rx, ry, rz): m and rad, axes of the reference frame, "
    "about the object's origin",
)
OBJECT = "# object: "
POSE = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
COLUMNS = ("object", "time_s", "status", *POSE)
AXES = ("x", "y", "z", "rx", "ry", "rz")
UPPER = np.triu_indices(6)
COVARIANCE = tuple(f"cov_{AXES[i]}_{AXES[j]}" for i, j in zip(*UPPER, strict=True))


def table_text(trajectories: Sequence[Trajectory]) -> str:
    """The text of the file. Numbers have the digits that give the same double back; unknown ones are empty."""
    with_covariance = any(t.covariances is not None for t in trajectories)
    heads = [json.dumps({"name": t.name, "frame": t.frame}, ensure_ascii=False) for t in trajectories]
    rows = [*HEADER, *(text_cell(OBJECT + head) for head in heads)]  # one cell each, whatever the name
    rows.append(",".join([*COLUMNS, *(COVARIANCE if with_covariance else ())]))
    for t in trajectories:
        name = text_cell(t.name)
        for i, (time, T) in enumerate(zip(t.times_s, t.poses, strict=True)):
            pose = [*T[:3, 3], *quaternion(T[:3, :3])] if np.isfinite(T).all() else [np.nan] * 7
            C = np.full((6, 6), np.nan) if t.covariances is None else t.covariances[i]
            numbers = [*pose, *(C[UPPER] if with_covariance else ())]
            status = "ok" if t.status is None else t.status[i]
            rows.append(
                ",".join(
                    [
                        name,
                        repr(float(time)),
                        status,
                        *(repr(float(v)) if np.isfinite(v) else "" for v in numbers),
                    ]
                )
            )
    return "\n".join(rows) + "\n"


def read_table(path: Path, text: str, fps: float | None) -> list[Record]:
    """One record per object, in the order of the header lines."""
    lines = text.split("\n")
    start = next((i for i, line in enumerate(lines) if not line.startswith(("#", '"#'))), len(lines))
    frames = _frames(path, lines[:start])
    reader = csv.DictReader(io.StringIO("\n".join(lines[start:]), newline=""))
    missing = [column for column in COLUMNS if column not in (reader.fieldnames or ())]
    if missing:
        raise ValueError(
            f"{path}, line {start + 1}: expected the columns {','.join(COLUMNS)}, {missing[0]} is missing"
        )
    known = [column for column in COVARIANCE if column in (reader.fieldnames or ())]
    if known and len(known) < len(COVARIANCE):
        raise ValueError(
            f"{path}: expected all {len(COVARIANCE)} columns {COVARIANCE[0]}, ..., or none, got {len(known)}"
        )
    rows: dict[str, list[tuple[int, str, list[float]]]] = {name: [] for name in frames}
    statuses = set(Status)
    columns = ("time_s", *POSE, *known)
    for row in reader:
        line = start + reader.line_num
        name, status = cell_text(row["object"] or ""), row["status"]
        if name not in rows:
            raise ValueError(
                f"{path}, line {line}: expected an object of the header, {shown(list(rows))}, got {shown(name)}"
            )
        if status not in statuses:
            raise ValueError(
                f"{path}, line {line}: expected a status of {[str(s) for s in Status]}, got {shown(status)}"
            )
        numbers = [_number(row[column], column, f"{path}, line {line}") for column in columns]
        rows[name].append((line, status, numbers))
    return [_record(path, name, frames[name], rows[name], fps) for name in frames if rows[name]]


def _record(
    path: Path, name: str, frame: str, rows: list[tuple[int, str, list[float]]], fps: float | None
) -> Record:
    numbers = np.array([row[2] for row in rows], np.float64)
    times = numbers[:, 0] if fps is None else np.arange(len(rows)) / fps
    poses = quaternions_as_poses(numbers[:, 1:4], numbers[:, 4:8], lambda i: f"{path}, line {rows[i][0]}")
    covariances = None
    if numbers.shape[1] > 8:
        covariances = np.zeros((len(rows), 6, 6))
        covariances[:, UPPER[0], UPPER[1]] = covariances[:, UPPER[1], UPPER[0]] = numbers[:, 8:]
    status = gaps_as_lost(poses, [row[1] for row in rows])
    return Record(name, times, poses, status, covariances, frame=frame)


def _frames(path: Path, lines: list[str]) -> dict[str, str]:
    """Reference frame of each object of the header lines."""
    try:
        texts = [next(csv.reader([line]))[0] if line.startswith('"') else line for line in lines]
        heads: list[Any] = [json.loads(text[len(OBJECT) :]) for text in texts if text.startswith(OBJECT)]
        return {str(head["name"]): str(head["frame"]) for head in heads}
    except (ValueError, TypeError, KeyError):
        raise ValueError(
            f'{path}: expected header lines \'{OBJECT}{{"name": ..., "frame": ...}}\', got one that is not'
        ) from None


def _number(text: str | None, column: str, place: str) -> float:
    """NaN for an empty cell; a row that ends early is an error, since its last number may be cut off too."""
    try:
        if text is None:
            raise ValueError
        return float(text) if text.strip() else float("nan")
    except ValueError:
        raise ValueError(
            f"{place}: expected a number as {column}, got {shown(text or 'the end of the row')}"
        ) from None
