# SPDX-License-Identifier: MIT
"""What each option of the tracker does to the error: one row per option, everything else at its default.

python -m sdftrack.eval.ablation --data DIR     # DIR holds meshes/, ycbv10/ and k1/
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np

from experiments.tracking.recorded import run_k1, run_ycbv10
from experiments.tracking.synthetic import run_mesh
from sdftrack.reproduce.scenes.truth import default_camera, motion, render_truth
from sdftrack.options import TrackerOptions

__all__ = ["VARIANTS", "main"]

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


def _row(options: dict[str, Any], sdf: Any, truths: dict[str, list[Any]], data: Path) -> list[str]:
    cells = []
    for sigma in SIGMAS_M:
        q = run_mesh(sdf, truths["slow"], sigma, options)
        cells.append(f"{q['mean_mm']:.3f} / {q['mean_deg']:.3f}, {q['bias_mm'][2]:+.3f}")
    q = run_mesh(sdf, truths["fast"], SIGMAS_M[0], options)
    cells.append(f"{q['astray'] + q['lost']}")
    real = run_ycbv10(data / "ycbv10", STARTS, YCB_FRAMES, options=options)
    cells.append(" / ".join(f"{real[n]['back_percent']:.0f}" for n in ("box", "mug", "brick")))
    k1 = run_k1(data / "k1", options=options)
    cells.append(" / ".join(f"{k1[n]['spread_deg']:.2f}" for n in ("left", "right")))
    worst = [max(mm for mm, _ in k1[n]["hand"].values()) for n in ("left", "right")]
    cells.append(" / ".join(f"{mm:.1f}" for mm in worst))
    cells.append(f"{q['ms_per_frame']:.2f}")
    return cells


def main(arguments: Seq[str] | None = None) -> int:
    """Print the table in Markdown, row by row."""
    import sdftrack as st

    parser = argparse.ArgumentParser(prog="python -m sdftrack.eval.ablation")
    parser.add_argument("--data", type=Path, required=True, help="folder with meshes/, ycbv10/ and k1/")
    parser.add_argument("--cache", type=Path, help="folder that keeps noise-free images between runs")
    a = parser.parse_args(arguments)
    warnings.simplefilter("ignore")
    mesh = st.Mesh.load(a.data / "meshes" / f"{MESH}.ply")
    sdf = st.SDF.from_mesh(mesh)
    centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    steps = {"slow": (0.005, 1.5), "fast": (0.018, 6.0)}
    truths = {
        name: [
            render_truth(mesh, motion(FRAMES, m, np.deg2rad(deg), 0, centre), default_camera(), 0, a.cache)
        ]
        for name, (m, deg) in steps.items()
    }
    print(
        "| option | drill 1 mm: mean mm / deg, z bias | drill 3.16 mm | drill 18 mm / 6 deg: lost or astray | "
        "box / mug / brick back, % | sponges still, deg | sponges in the hand, worst mm | ms |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name, options in VARIANTS.items():
        cells = _row({"threads": 1, **options}, sdf, truths, a.data)
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
