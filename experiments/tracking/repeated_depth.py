# SPDX-License-Identifier: MIT
"""Depth images that come twice: what is said of them in recorded sequences."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

from experiments.common.protocol import say
from experiments.common.recordings import FOLDERS, opened, recordings_of
from experiments.registry import experiment
from experiments.table import Table

SAID = "the depth image repeats the previous one"
SHARE = 0.05  # of the frames
SURE_SD = 3  # an error beyond so many standard deviations contradicts the covariance
COLUMNS = ("object", "frames", "repeated", "named", "ok", "beyond 3 sd and ok", "in the recording itself")


def follow(case: Any, mode: str, stop: int, seed: int) -> dict[str, int]:
    """Counts of one sequence, a twentieth of whose depth images are their predecessors."""
    import sdftrack as st
    from sdftrack import metrics

    frames = min(len(case.seq), stop) if stop else len(case.seq)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(np.arange(2, frames), max(1, round(SHARE * frames)), replace=False)
    tracker = st.Tracker(case.sdf, case.seq.camera, mode=mode, threads=1)
    before = None
    n = dict.fromkeys(("frames", "repeated", "named", "ok", "wrong_ok", "own"), 0)
    for i in range(frames):
        frame = case.seq[i]
        if i in chosen:
            frame = st.Frame(before, frame.color, timestamp=frame.timestamp)
        before = frame.depth
        result = tracker.track(frame) if i else tracker.start(frame, poses=[case.truth(0)])
        n["frames"] += 1
        if i not in chosen:
            n["own"] += SAID in result.reason[0]
            continue
        n["repeated"] += 1
        n["named"] += SAID in result.reason[0]
        n["ok"] += result.ok
        if result.ok and case.truth(i) is not None:
            error = metrics.pose_error(result.pose, case.truth(i))
            sd = np.sqrt(np.diag(result.covariance))
            n["wrong_ok"] += bool(error[0] > SURE_SD * sd[:3].max() or error[1] > SURE_SD * sd[3:].max())
    return n


@experiment(
    "repeated_depth",
    uses=FOLDERS,
    chosen_on="both sponges of k1, the cube of visp_rbt, the mug of ycbv10",
    reported_on="the bottle of mustard0, the dragon of visp_rbt, box and brick of ycbv10 (part=report)",
    short={"stop": 12},
)
def repeated_depth(
    *,
    data: Path,
    part: Literal["choose", "report"] = "report",
    mode: Literal["depth", "rgbd"] = "rgbd",
    stop: int = 0,
    seed: int = 0,
) -> Table:
    """Depth images replaced by their predecessors in 5 % of the frames of recorded sequences: named, and never ok.

    Parameters
    ----------
    stop
        frames of each sequence; 0: all
    """
    rows = {}
    for recording in recordings_of(part):
        if not (data / recording.folder).is_dir():
            continue
        with opened(recording, data) as case:
            rows[f"{recording.folder} {recording.name}"] = follow(case, mode, stop, seed)
        say(f"{recording.folder} {recording.name}: {list(rows.values())[-1]}")
    title = f"depth images replaced by their predecessors, {mode}, {part}"
    return Table(
        title, COLUMNS, [[name, *(str(v) for v in n.values())] for name, n in rows.items()], numbers=rows
    )
