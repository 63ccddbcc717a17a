# SPDX-License-Identifier: MIT
"""What ``track`` and ``reconstruct`` print in the end: how many frames were followed, how well, and where not."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack.cli.common import show_table

__all__ = ["show_summary"]

COLORS = {"ok": "green", "weak": "yellow", "lost": "red", "bad frame": "bright_black"}
EVENTS = 5  # lines about trouble after the table


def show_summary(
    folder: Path,
    names: list[str],
    results: list[Any],
    truths: list[dict[int, Any]],
    ids: list[int],
    out: Path,
) -> None:
    """Print it; `truths` and `ids` (of the images) one per result, a truth being {k: T_cam_obj} where known."""
    from sdftrack.metrics import pose_error

    rows = []
    for k, name in enumerate(names):
        status = [str(r.status[k]) for r in results]
        errors = []
        for truth, r in zip(truths, results, strict=True):
            if k in truth and str(r.status[k]) in ("ok", "weak"):
                errors.append(pose_error(r.poses[k], truth[k]))
        counts = [str(status.count(s)) for s in ("ok", "weak", "lost", "bad_frame")]
        mean = np.mean(errors, axis=0) if errors else (np.nan, np.nan)
        accuracy = [f"{1e3 * mean[0]:.2f}", f"{np.rad2deg(mean[1]):.2f}"] if errors else ["-", "-"]
        rows.append([name, *counts, *accuracy])
    head = ["object", "ok", "weak", "lost", "bad frame", "mean mm", "mean deg"]
    milliseconds = 1e3 * float(np.median([r.seconds for r in results]))
    show_table(
        f"{folder}: {len(results)} frames, {milliseconds:.2f} ms per frame -> {out}", head, rows, COLORS
    )
    events = list(_events(names, results, ids))
    for line in events[:EVENTS]:
        print(line)
    if len(events) > EVENTS:
        print(f"and {len(events) - EVENTS} more, see report.json")


def _events(names: list[str], results: list[Any], ids: list[int]) -> Iterator[str]:
    """Where an object stops being ok: one line for each run of frames with one status."""
    for k, name in enumerate(names):
        begin = 0
        status = [str(r.status[k]) for r in results]
        for i in range(1, len(status) + 1):
            if i < len(status) and status[i] == status[begin]:
                continue
            if status[begin] not in ("ok", "weak"):
                which = f"image {ids[begin]}" if i - begin == 1 else f"images {ids[begin]} to {ids[i - 1]}"
                yield f"{name} {status[begin]}, {which}: {results[begin].reason[k]}"
            begin = i
