# SPDX-License-Identifier: MIT
"""report.json of a result folder, read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sdftrack._internal.text_files import contents, read_json
from sdftrack.results import Status, TrackResult

__all__ = ["read_results", "result_of"]


def read_results(directory: Path) -> dict[str, Any]:
    """The report of a run; FileNotFoundError or ValueError in one line."""
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
    """The TrackResult of a frame of report.json."""
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
        twists=np.full((count, 6), np.nan),
        inliers=numbers("inliers", np.nan),
        runner_up=nan,
        energy=float(objects[0].get("energy") or np.nan) if objects else np.nan,
        seconds=row.get("seconds") or 0.0,
        timestamp=row.get("timestamp"),
    )
