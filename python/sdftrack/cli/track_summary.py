# SPDX-License-Identifier: MIT
"""Summary printed by ``track`` and ``reconstruct``: tracked frames, errors, and failures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import sdftrack as st
from sdftrack.cli.common import show_table

COLORS = {"ok": "green", "weak": "yellow", "lost": "red", "bad frame": "bright_black"}
EVENTS = 5  # lines about trouble after the table


class StatusCounts:
    """How often objects were weak or lost so far, for the progress."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}

    def add(self, result: Any) -> None:
        for status in map(str, result.status):
            self._counts[status] = self._counts.get(status, 0) + 1

    def __call__(self) -> str:
        named = ((status, self._counts.get(status, 0)) for status in ("weak", "lost", "bad_frame"))
        return ", ".join(f"{n} {status.replace('_', ' ')}" for status, n in named if n)


def show_summary(
    folder: Path,
    names: list[str],
    results: list[Any],
    truths: list[dict[int, Any]],
    ids: list[int],
    out: Path,
    alike: dict[int, Any] | None = None,
) -> None:
    """Print the summary; `truths` and `ids` (of the images) one per result, each truth {k: T_cam_obj} if known.

    `alike`: {k: Symmetry}, modulo which errors are computed.
    """

    rows = []
    for k, name in enumerate(names):
        status = [str(r.status[k]) for r in results]
        errors = []
        for truth, r in zip(truths, results, strict=True):
            if k in truth and str(r.status[k]) in ("ok", "weak"):
                symmetry = (alike or {}).get(k)
                true = truth[k] if symmetry is None else symmetry.canonical(truth[k], near=r.poses[k])
                errors.append(st.metrics.pose_error(r.poses[k], true))
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


UNITS = "the units of --model (--unit) and of the depth"
NEXT = {
    "gt": "check that --model is the object of the ground truth, in its unit (--unit) and its frame",
    "poses": "check the poses' unit (m) and direction (T_cam_obj), and the unit of --model (--unit)",
    "auto": "give its location: --init box:x,y,w,h, --init click:x,y or --init mask.png",
    "mask": f"check that the mask shows the object in the first image, and {UNITS}",
    "box": f"try a mask, --init mask.png, and check {UNITS}",
    "click": f"try a box or a mask, --init box:x,y,w,h or --init mask.png, and check {UNITS}",
}


def lost_throughout(folder: Path, names: list[str], results: list[Any], inits: list[str]) -> Iterator[str]:
    """One line for each object without any pose: since when, why, and what to try next."""
    for k, name in enumerate(names):
        if any(str(r.status[k]) in ("ok", "weak") for r in results):
            continue
        step = NEXT[inits[min(k, len(inits) - 1)]]
        first = next((r for r in results if str(r.status[k]) == "lost"), results[0])
        count = "the only frame" if len(results) == 1 else f"all {len(results)} frames"
        yield f"{folder}: {name} is lost in {count} ({first.reason[k]}); next: {step}"


def _events(names: list[str], results: list[Any], ids: list[int]) -> Iterator[str]:
    """Events where an object is not ok: one line per run of frames with the same status."""
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
