# SPDX-License-Identifier: MIT
"""Trajectories as a table: CSV with one row per object and frame, which loses nothing."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack._internal.csv_cells import cell_text, text_cell
from sdftrack._internal.rotations import quaternion
from sdftrack._internal.validation import shown
from sdftrack.motion.files.record import Array, Record, gaps_as_lost, quaternions_as_poses
from sdftrack.motion.trajectory import Trajectory
from sdftrack.results import Status

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
            rows.append(",".join([name, repr(float(time)), status, *(_cell(v) for v in numbers)]))
    return "\n".join(rows) + "\n"


def _cell(value: float) -> str:
    return repr(float(value)) if np.isfinite(value) else ""


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
    covariances = _symmetric(numbers[:, 8:]) if numbers.shape[1] > 8 else None
    status = gaps_as_lost(poses, [row[1] for row in rows])
    return Record(name, times, poses, status, covariances, frame=frame)


def _symmetric(upper: Array) -> Array:
    C = np.zeros((len(upper), 6, 6))
    C[:, UPPER[0], UPPER[1]] = upper
    C[:, UPPER[1], UPPER[0]] = upper
    return C


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
