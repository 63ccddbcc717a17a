# SPDX-License-Identifier: MIT
"""Tracking of recorded objects against their reference poses, by the measures that trackers are published with."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

from experiments.common.protocol import say
from experiments.common.recordings import FOLDERS, Opened, opened, recordings_of
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table, cells

POINTS, FAR_M, LEAST = 1000, 0.015, 30
COLUMNS = {
    "object, mode": "name",
    **{name: f"{name}:d" for name in ("frames", "ok", "weak", "lost")},
    "ADD mm": "add_mm:.1f",
    "ADD-S mm": "adds_mm:.1f",
    "deg": "deg:.2f",
    "AUC ADD": "auc_add:.1f",
    "AUC ADD-S": "auc_adds:.1f",
    "ok beyond 15 mm": "far_ok:d",
    "ms": "ms:.2f",
    "99 % ms": "ms_99:.1f",
}
STEADY = [
    "object, mode", "frames", "constant mm", "constant deg", "beyond it mm", "90 % mm", "beyond it deg", "90 % deg"
]  # fmt: skip


@experiment(
    "real.references",
    needs=FOLDERS,
    chosen_on="visp_rbt's cube, ycbv10's mug (`--part choose`); mustard0 and the dragon were looked at too",
    reported_on="mustard0, visp_rbt's dragon, ycbv10's box and brick (`--part report`)",
    short={"mode": ("depth",), "every": 40, "voxels": 80},
)
def references(
    *,
    data: Path,
    part: Literal["choose", "report"] = "report",
    mode: tuple[Literal["depth", "rgbd"], ...] = ("depth", "rgbd"),
    every: int = 1,
    voxels: int = 160,
    threads: int = 1,
    options: Settings = NO_SETTINGS,
) -> list[Table]:
    """Recorded objects started at their reference pose and tracked: ADD, ADD-S, AUC to 10 cm, what is lost.

    A frame that is lost counts as infinitely far. Medians of ADD, ADD-S and degrees are of the others. The second
    table takes a constant offset in the camera's frame and a constant turn in the object's out of the errors (where
    the reference says which of its frames are good, in these): what a reference has wrong in all frames alike.

    Parameters
    ----------
    part
        recordings that defaults were chosen on, or those that were not looked at for that
    every
        only each such frame: the faster motion of a slower camera
    """
    rows: dict[str, dict[str, Any]] = {}
    for recording in recordings_of(part):
        if recording.folder == "k1":  # its reference is a fit, without a measure of its own
            continue
        with opened(recording, data, voxels) as it:
            for way in mode:
                name = f"{recording.folder} {recording.name}, {way}"
                rows[name] = _followed(it, way, every, {"threads": threads, **options})
                say("  ".join(cells(COLUMNS, {"name": name, **rows[name]})))
    title = f"From the reference pose, every {every}. frame" if every > 1 else "From the reference pose"
    steady = [[name, *row["steady"]] for name, row in rows.items() if row["steady"]]
    return [
        Table.of(title, COLUMNS, rows),
        Table(f"{title}: beyond a constant offset and turn", STEADY, steady),
    ]


def _followed(it: Opened, mode: str, every: int, told: dict[str, Any]) -> dict[str, Any]:
    import sdftrack as st

    frames = [i for i in range(0, len(it.seq), every) if it.truth(i) is not None]
    tracker = st.Tracker(it.sdf, it.seq.camera, mode=mode, **told)
    vertices = it.mesh.vertices
    points = vertices[np.random.default_rng(0).permutation(len(vertices))[:POINTS]]
    add, adds, degrees, seconds, status = [], [], [], [], []
    good, pairs = it.good_frames(), []
    for n, i in enumerate(frames):
        truth = it.truth(i)
        result = tracker.track(it.seq[i]) if n else tracker.start(it.seq[i], poses=truth)
        seconds.append(result.seconds)
        status.append(result.status[0].value)
        lost = status[-1] not in ("ok", "weak")
        add.append(np.inf if lost else float(st.metrics.add(result.pose, truth, points)))
        adds.append(np.inf if lost else float(st.metrics.adds(result.pose, truth, points)))
        if not lost and i in good:
            pairs.append((result.pose, truth))
        degrees.append(np.nan if lost else np.degrees(st.metrics.pose_error(result.pose, truth)[1]))
    sure = np.array(status) == "ok"
    return {
        "frames": len(frames),
        **{s: status.count(s) for s in ("ok", "weak", "lost")},
        "add_mm": 1e3 * float(np.median(add)),
        "adds_mm": 1e3 * float(np.median(adds)),
        "deg": float(np.nanmedian(degrees)) if np.isfinite(degrees).any() else float("nan"),
        "auc_add": 100 * float(st.metrics.auc(add)),
        "auc_adds": 100 * float(st.metrics.auc(adds)),
        "far_ok": int((sure & (np.array(adds) > FAR_M)).sum()),
        "ms": 1e3 * float(np.median(seconds)),
        "ms_99": 1e3 * float(np.percentile(seconds, 99)),
        "steady": _beyond_a_constant(pairs) if len(pairs) >= LEAST else [],
    }


def _beyond_a_constant(pairs: list[tuple[Any, Any]]) -> list[str]:
    """The constant offset (mm) and turn (degrees), then median and 90 % of what is left of both."""
    from scipy.spatial.transform import Rotation

    off_m = np.array([T[:3, 3] - truth[:3, 3] for T, truth in pairs])
    constant_m = np.median(off_m, axis=0)
    left_mm = 1e3 * np.linalg.norm(off_m - constant_m, axis=1)
    turns = Rotation.from_matrix([truth[:3, :3].T @ T[:3, :3] for T, truth in pairs])
    constant = turns.mean()
    left_deg = np.degrees((constant.inv() * turns).magnitude())
    return [
        str(len(pairs)), f"{1e3 * np.linalg.norm(constant_m):.1f}", f"{np.degrees(constant.magnitude()):.1f}",
        f"{np.median(left_mm):.2f}", f"{np.percentile(left_mm, 90):.2f}",
        f"{np.median(left_deg):.2f}", f"{np.percentile(left_deg, 90):.2f}",
    ]  # fmt: skip
