# SPDX-License-Identifier: MIT
"""Trajectories of a result folder: report.json of `sdftrack track`, `reconstruct` and `live`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sdftrack._internal.text_files import contents
from sdftrack.io.report_file import read_results, result_of
from sdftrack.motion.files.record import Record, times_from_numbers

__all__ = ["read_result_folder"]


def read_result_folder(folder: Path, fps: float | None) -> list[Record]:
    """One record per object that the report has in any frame; where a frame does not have it, it is lost."""
    path = folder / "report.json"
    rows = read_results(folder)["frames"]
    with contents(path, "a report of sdftrack"):
        results = [result_of(row) for row in rows]
        # Objects may be added and removed while a camera runs: k numbers them, not their position in a frame.
        places = [{int(entry["k"]): i for i, entry in enumerate(row["objects"])} for row in rows]
        images = np.array([row["im_id"] for row in rows], np.float64)
        stamps = np.array([np.nan if r.timestamp is None else r.timestamp for r in results], np.float64)
        entries = {int(entry["k"]): entry for row in rows for entry in row["objects"]}
        names = {k: (str(e["name"]), int(e["obj_id"])) for k, e in sorted(entries.items())}
    if fps is not None or not np.isfinite(stamps).all():
        missing = int(np.count_nonzero(~np.isfinite(stamps)))
        why = f"{path}: {missing} of {len(rows)} frames have no timestamp"
        stamps = times_from_numbers(images, fps, why)
    records = []
    for k, (name, obj_id) in names.items():
        poses, covariances = np.full((len(rows), 4, 4), np.nan), np.full((len(rows), 6, 6), np.nan)
        status = ["lost"] * len(rows)
        for i, (result, place) in enumerate(zip(results, places, strict=True)):
            if k in place:
                j = place[k]
                poses[i], covariances[i], status[i] = (
                    result.poses[j],
                    result.covariances[j],
                    str(result.status[j]),
                )
        records.append(Record(name, stamps, poses, status, covariances, obj_id))
    return records
