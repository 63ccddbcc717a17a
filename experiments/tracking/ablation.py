# SPDX-License-Identifier: MIT
"""What each option of the tracker does to the error."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import sdftrack as st
from experiments.common.protocol import load_mesh, say
from experiments.registry import experiment
from experiments.table import Table
from experiments.thesis.scenes.truth import default_camera, motion, render_truth
from experiments.tracking.random_starts import run_ycbv10
from experiments.tracking.still_and_in_hand import run_k1
from experiments.tracking.synthetic import run_mesh
from sdftrack.options import TrackerOptions

__all__ = ["VARIANTS", "ablation"]

# Changing these numbers breaks comparisons with docs/results.md.
MESH, FRAMES, SIGMAS_M = "lm_driller", 100, (0.001, 0.00316)
STARTS, YCB_FRAMES = 20, 3

VARIANTS: dict[str, dict[str, Any]] = {
    "default": {},
    "printed energy and optimiser": TrackerOptions.printed().to_dict(),
    "residual: phi at the measured point": {"residual": "point"},
    "residual: phi over its slope": {"residual": "slope"},
    "no outlier floor": {"outlier_floor": 0.0},
    "printed curvature, coarse to fine": {"curvature": "printed"},
    "no coarse stages": {"scale_start_m": 0.0, "retry_inliers": 0.0},
    "no second, wider attempt": {"retry_inliers": 0.0},
    "always wide (10 mm, 40 mm padding)": {"scale_start_m": 0.010, "padding_m": 0.04, "retry_inliers": 0.0},
    "no free-space term": {"free_space": False},
    "no motion prior": {"motion_sigma_m": 0.0},
    "fixed noise of 1 mm": {"adapt_noise": False},
    "dominant plane left out": {"drop_plane": True},
    "2,000 pixels": {"max_pixels": 2000},
}


def _row(
    options: dict[str, Any], sdf: Any, truths: dict[str, list[Any]], data: Path, starts: int
) -> list[str]:
    cells = []
    for sigma in SIGMAS_M:
        q = run_mesh(sdf, truths["slow"], sigma, options)
        cells.append(f"{q['mean_mm']:.3f} / {q['mean_deg']:.3f}, {q['bias_mm'][2]:+.3f}")
    q = run_mesh(sdf, truths["fast"], SIGMAS_M[0], options)
    cells.append(f"{q['wrong'] + q['lost']}")
    real = run_ycbv10(data / "ycbv10", starts, YCB_FRAMES, options=options)
    cells.append(" / ".join(f"{real[n]['back_percent']:.0f}" for n in ("box", "mug", "brick")))
    k1 = run_k1(data / "k1", options=options)
    cells.append(" / ".join(f"{k1[n]['spread_deg']:.2f}" for n in ("left", "right")))
    worst = [max(mm for mm, _ in k1[n]["hand"].values()) for n in ("left", "right")]
    cells.append(" / ".join(f"{mm:.1f}" for mm in worst))
    cells.append(f"{q['ms_per_frame']:.2f}")
    return cells


COLUMNS = (
    "option", "drill 1 mm: mean mm / deg, z bias", "drill 3.16 mm", "drill 18 mm / 6 deg: lost or wrong",
    "box / mug / brick back, %", "sponges still, deg", "sponges in the hand, worst mm", "ms",
)  # fmt: skip


@experiment(
    "ablation",
    needs=["meshes", "ycbv10", "k1"],
    chosen_on="lm_driller, ycbv10 and k1",
    reported_on="the same: the table says what each option does, not how well it generalises",
    short={"only": ("default",), "frames": 10, "starts": 3},
)
def ablation(
    *,
    data: Path,
    only: tuple[str, ...] = (),
    frames: int = FRAMES,
    starts: int = STARTS,
    cache: Path | None = None,
) -> Table:
    """What each option of the tracker does to the error: one row per option, everything else at its default.

    Parameters
    ----------
    only
        rows, by the beginning of their names, comma separated; none: all
    starts
        of each object of ycbv10
    """
    mesh = load_mesh(data, MESH)
    sdf = st.SDF.from_mesh(mesh)
    centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    steps = {"slow": (0.005, 1.5), "fast": (0.018, 6.0)}
    truths = {
        name: [render_truth(mesh, motion(frames, m, np.deg2rad(deg), 0, centre), default_camera(), 0, cache)]
        for name, (m, deg) in steps.items()
    }
    rows = []
    for name, options in VARIANTS.items():
        if only and not name.startswith(only):
            continue
        rows.append([name, *_row({"threads": 1, **options}, sdf, truths, data, starts)])
        say("  ".join(rows[-1]))
    return Table("One option changed at a time", COLUMNS, rows)
