# SPDX-License-Identifier: MIT
"""What each option of the tracker contributes: one at a time is changed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments.common.protocol import load_mesh, load_sdf, say
from experiments.registry import experiment
from experiments.table import Table, cells
from experiments.tracking.random_starts import YCB_NAMES, run_ycbv10
from experiments.tracking.synthetic import follow, joined, paths

PRINTED = "printed energy and optimiser"
VARIANTS: dict[str, dict[str, Any]] = {
    "default": {},
    "residual: phi at the measured point": {"residual": "point"},
    "residual: phi over its slope": {"residual": "slope"},
    "no outlier floor": {"outlier_floor": 0.0},
    "printed curvature, coarse to fine": {"curvature": "printed"},
    "no coarse stages": {"scale_start_m": 0.0},
    "no second, wider attempt": {"retry_inliers": 0.0},
    "no free-space term": {"free_space": False},
    "no motion prior": {"motion_sigma_m": 0.0},
    "fixed noise of 1 mm": {"adapt_noise": False, "noise_m": 0.001},
    "dominant plane left out": {"drop_plane": True},
    "2,000 pixels": {"max_pixels": 2000},
    PRINTED: {},
}
WAYS = {"small": (0.001, 5.0, 1.5), "noisy": (0.00316, 5.0, 1.5), "large": (0.001, 18.0, 6.0)}
COLUMNS = {
    "option": "option",
    "1 mm: mean mm": "small_mm:.3f",
    "mean deg": "small_deg:.3f",
    "z bias mm": "small_bias:+.3f",
    "3.16 mm: mean mm": "noisy_mm:.3f",
    "mean deg ": "noisy_deg:.3f",
    "z bias mm ": "noisy_bias:+.3f",
    "18 mm, 6 deg per frame: lost or wrong": "large_lost:d",
    "starts back %: box": "box:.0f",
    "mug": "mug:.0f",
    "brick": "brick:.0f",
}


@experiment(
    "ablation",
    needs=["meshes", "ycbv10"],
    chosen_on="the same mesh and recording, other seeds",
    reported_on="lm_driller, seed 0; ycbv10",
    short={"frames": 15, "starts": 2, "voxels": 80},
)
def ablation(
    *,
    data: Path,
    frames: int = 100,
    starts: int = 20,
    voxels: int = 160,
    threads: int = 0,
    only: tuple[str, ...] = (),
) -> Table:
    """One option changed at a time: a drill tracked with two noises and with large steps, recorded objects started.

    The drill among nothing else, from its true pose. "starts back": of starts 10 mm and 5 degrees off on a table, those
    within 2 mm (mug 2.5) and 1.5 degrees after 3 frames.

    Parameters
    ----------
    only
        rows, by the start of their names; none: all
    """
    import sdftrack as st

    mesh = load_mesh(data, "lm_driller")
    sdf = load_sdf(mesh, "lm_driller", voxels, None)
    truths = {way: paths(mesh, 1, frames, mm, deg, threads)[0] for way, (_, mm, deg) in WAYS.items()}
    rows = []
    for name, changed in VARIANTS.items():
        if only and not name.startswith(only):
            continue
        options = {"threads": threads, **changed}
        if name == PRINTED:
            options |= {"options": st.TrackerOptions.printed(), "motion": "static", "recover": False}
        row: dict[str, Any] = {"option": name}
        for way, (sigma_m, _, _) in WAYS.items():
            found = joined([follow(sdf, truths[way], sigma_m, 0, options)])
            row |= {
                f"{way}_mm": found["mean_mm"],
                f"{way}_deg": found["mean_deg"],
                f"{way}_bias": found["bias_z_mm"],
            }
            row[f"{way}_lost"] = found["lost"] + found["wrong"]
        recorded = run_ycbv10(data / "ycbv10", starts, 3, tuple(YCB_NAMES), voxels, options, False)
        row |= {which: of_it["back_percent"] for which, of_it in recorded.items()}
        rows.append(row)
        say("  ".join(cells(COLUMNS, row)))
    return Table.of(f"One option changed at a time, {frames} frames, {starts} starts", COLUMNS, rows)
