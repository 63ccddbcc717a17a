# SPDX-License-Identifier: MIT
"""Frames without depth among others, and tracking by colour alone: what the outline in the image holds."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

from experiments.common.protocol import load_mesh, load_sdf, say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table
from experiments.trust.coverage import error_vector

CHOSEN_ON = ("bunny", "lm_can", "lm_driller", "lm_glue")
REPORTED_ON = ("lm_ape", "lm_cat", "lm_duck", "spot")
TENTH, IN_A_ROW, BY_COLOR = "every tenth without depth", "30 in a row without depth", "mode rgb"
CHI2_95 = 12.59  # of six unknowns
ASIDE_M, TURN_RAD = 0.005, np.deg2rad(3.0)
HEAD = [
    "mesh, case", "frames", "lost", "mean mm", "max mm", "mean deg", "max deg", "aside mm", "near %",
    "in the 95 % ellipsoid, %", "ms",
]  # fmt: skip


def _without(case: str, frames: int) -> set[int]:
    if case == TENTH:
        return set(range(9, frames, 10))
    if case == IN_A_ROW:
        return set(range(30, min(60, frames)))
    return set(range(1, frames))


def _row(sdf: Any, seq: Any, case: str, told: dict[str, Any]) -> dict[str, Any]:
    """Of the frames without depth: errors, how many are near in the image plane and in turn, and what is stated."""
    import sdftrack as st

    blind = _without(case, len(seq))
    mode = "rgb" if case == BY_COLOR else "rgbd"
    tracker = st.Tracker(sdf, seq.camera, mode=mode, **{"outline": True, **told})
    mm, deg, aside, held, seconds, lost = [], [], [], [], [], 0
    for i in range(len(seq)):
        seen, T = seq[i], seq.ground_truth[i][0]
        frame = st.Frame(None, seen.color, timestamp=seen.timestamp) if i in blind else seen
        result = tracker.track(frame) if i else tracker.start(frame, poses=[T])
        if i not in blind:
            continue
        seconds.append(result.seconds)
        if str(result.status[0]) not in ("ok", "weak"):
            lost += 1
            continue
        metres, radians = st.metrics.pose_error(result.poses[0], T)
        mm.append(1e3 * metres)
        deg.append(np.rad2deg(radians))
        aside.append(1e3 * float(np.linalg.norm((result.poses[0] - T)[:2, 3])))
        e = error_vector(result.poses[0], T)
        held.append(float(e @ np.linalg.solve(result.covariances[0], e)) <= CHI2_95)
    near = np.sum((np.array(aside) < 1e3 * ASIDE_M) & (np.array(deg) < np.rad2deg(TURN_RAD)))
    return {
        "frames": len(blind), "lost": lost, "mean_mm": float(np.mean(mm)), "max_mm": float(np.max(mm)),
        "mean_deg": float(np.mean(deg)), "max_deg": float(np.max(deg)), "aside_mm": float(np.mean(aside)),
        "near_percent": 100 * float(near) / len(blind), "held_percent": 100 * float(np.mean(held)),
        "ms": 1e3 * float(np.median(seconds)),
    }  # fmt: skip


def _cells(name: str, row: dict[str, Any]) -> list[str]:
    return [
        name, str(row["frames"]), str(row["lost"]), f"{row['mean_mm']:.2f}", f"{row['max_mm']:.1f}",
        f"{row['mean_deg']:.2f}", f"{row['max_deg']:.1f}", f"{row['aside_mm']:.2f}", f"{row['near_percent']:.0f}",
        f"{row['held_percent']:.0f}", f"{row['ms']:.2f}",
    ]  # fmt: skip


@experiment(
    "outline_alone",
    needs=["meshes"],
    chosen_on="bunny, lm_can, lm_driller, lm_glue (`--part choose`)",
    reported_on="lm_ape, lm_cat, lm_duck, spot; seed 0",
    short={"part": "report", "frames": 12, "voxels": 60},
)
def outline_alone(
    *,
    data: Path,
    part: Literal["choose", "report"] = "report",
    frames: int = 120,
    sigma: float = 0.001,
    voxels: int = 160,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """Frames without depth among others, and tracking by colour alone: what the outline in the image holds.

    5 mm and 1.5 deg per frame over a cluttered table; the first pose is given. Figures are of the frames without depth.

    Parameters
    ----------
    part
        meshes that defaults were chosen on, or others
    """
    import sdftrack as st

    rows: dict[str, dict[str, Any]] = {}
    for name in REPORTED_ON if part == "report" else CHOSEN_ON:
        mesh = load_mesh(data, name)
        sdf = load_sdf(mesh, name, voxels, cache)
        seq = st.synth.sequence(mesh, frames, noise=sigma, seed=0, clutter=True, threads=threads, cache=cache)
        for case in (TENTH, IN_A_ROW, BY_COLOR):
            if not _without(case, frames):
                continue
            row = _row(sdf, seq, case, {"threads": threads, **options})
            rows[f"{name}, {case}"] = row
            say("  ".join(_cells(f"{name}, {case}", row)))
    return Table(
        f"{frames} frames, noise {1e3 * sigma:g} mm, {part}",
        HEAD,
        [_cells(name, row) for name, row in rows.items()],
        [
            "wanted without depth: none lost, within 3 mm and 2 deg; by colour alone 95 % near: 5 mm aside and 3 deg",
        ],
        rows,
    )
