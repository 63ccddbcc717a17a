# SPDX-License-Identifier: MIT
"""Rows of the output files of a tracked sequence (BOP results, TUM trajectories, report.json), and reading them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import quaternion, rotation
from sdftrack._internal.text_files import contents, named, read_json, read_text
from sdftrack._internal.validation import shown
from sdftrack.results import Status, TrackResult

BOP_HEADER = "scene_id,im_id,obj_id,score,R,t,time"
Array = NDArray[np.float64]


def read_results(directory: Path) -> dict[str, Any]:
    path = Path(directory) / "report.json"
    if not Path(directory).is_dir():
        raise FileNotFoundError(f"{directory}: no such folder")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected the output of sdftrack track or st.Recorder")
    with contents(path, "a report of sdftrack"):
        report = read_json(path)
        report["frames"], report["settings"]
    return dict(report)


def result_of(row: dict[str, Any]) -> TrackResult:
    objects = row["objects"]
    count = len(objects)

    def numbers(name: str, missing: Any) -> Any:
        return np.array([missing if o.get(name) is None else o[name] for o in objects], np.float64)

    nan = np.full(count, np.nan)
    return TrackResult(
        poses=numbers("pose", np.full((4, 4), np.nan).tolist()).reshape(count, 4, 4),
        status=[Status(o["status"]) for o in objects],
        reason=[str(o["reason"]) for o in objects],
        confidence=numbers("confidence", 0.0),
        covariances=numbers("covariance", np.full((6, 6), np.nan).tolist()).reshape(count, 6, 6),
        unstated=numbers("unstated", np.zeros((6, 6)).tolist()).reshape(count, 6, 6),
        twists=np.full((count, 6), np.nan),
        inliers=numbers("inliers", np.nan),
        runner_up=nan,
        energy=float(objects[0].get("energy") or np.nan) if objects else np.nan,
        seconds=row.get("seconds") or 0.0,
        timestamp=row.get("timestamp"),
    )


def bop_row(result: TrackResult, k: int, scene_id: int, im_id: int, obj_id: int) -> str:
    T = result.poses[k]
    R = " ".join(f"{v:.9f}" for v in T[:3, :3].ravel())
    t = " ".join(f"{1e3 * v:.6f}" for v in T[:3, 3])
    score = number_or_none(result.confidence[k]) or 0.0
    seconds = number_or_none(result.seconds)
    time = "-1" if seconds is None else f"{seconds:.6f}"
    return f"{scene_id},{im_id},{obj_id},{score:.6f},{R},{t},{time}"


def object_entry(result: TrackResult, k: int, obj_id: int, name: str) -> dict[str, Any]:
    """Object k in ``report.json``: metres, the covariance as in Python, null where unknown."""
    part = None if result.unstated is None else result.unstated[k]
    return {
        "obj_id": obj_id,
        "k": k,
        "name": name,
        "status": str(result.status[k]),
        "reason": str(result.reason[k]),
        "confidence": number_or_none(result.confidence[k]),
        "energy": number_or_none(result.energy),
        "inliers": number_or_none(result.inliers[k]),
        "pose": plain(result.poses[k]) if np.isfinite(result.poses[k]).all() else None,
        "covariance": plain(result.covariances[k]) if np.isfinite(result.covariances[k]).all() else None,
        # The part of the covariance by a sensor of which nothing is stated, where there is one.
        **({"unstated": plain(part)} if part is not None and part.any() else {}),
    }


def plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, set)):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)


def number_or_none(value: Any) -> float | None:
    return float(value) if value is not None and np.isfinite(value) else None


TUM_HEADER = "# timestamp tx ty tz qx qy qz qw"


def tum_line(time_s: float, T: Array, digits: str = ".12g") -> str:
    """``timestamp tx ty tz qx qy qz qw`` (s, m) of a (4, 4) pose; `digits`: format of the numbers."""
    numbers = [*T[:3, 3], *quaternion(T[:3, :3])]
    return f"{time_s:.6f} " + " ".join(f"{v:{digits}}" for v in numbers)


def read_tum_rows(path: str | os.PathLike[str]) -> tuple[list[int], Array]:
    lines, rows = [], []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            row = [float(v) for v in line.replace(",", " ").split()]
        except ValueError:
            row = []
        if len(row) != 8:
            raise ValueError(
                f"{path}, line {number}: expected 'timestamp tx ty tz qx qy qz qw', got {shown(line)}"
            )
        lines.append(number)
        rows.append(row)
    return lines, np.array(rows, np.float64).reshape(-1, 8)


def read_tum(path: str | os.PathLike[str]) -> tuple[Array, Array]:
    """Timestamps (N,) in seconds and poses (N, 4, 4) of a TUM trajectory file."""
    lines, rows = read_tum_rows(path)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    for T, row, line in zip(poses, rows, lines, strict=True):
        with named(f"{os.fspath(path)}, line {line}"):
            T[:3, :3], T[:3, 3] = rotation(row[4:]), row[1:4]
    return rows[:, 0], poses


def log_lines(number: int, T: Array) -> list[str]:
    return [f"{number} {number} {number + 1}", *(" ".join(f"{v:.15g}" for v in row) for row in T)]


def read_log(path: str | os.PathLike[str]) -> dict[int, Array]:
    """Poses of a Redwood trajectory log, by the first integer of their header line."""
    lines = [s.split() for s in read_text(path).splitlines() if s.strip()]
    with contents(path, "blocks of 'i i n' and four rows of four numbers"):
        blocks = [lines[i : i + 5] for i in range(0, len(lines), 5)]
        return {int(head[0]): np.array(rows, dtype=np.float64).reshape(4, 4) for head, *rows in blocks}
