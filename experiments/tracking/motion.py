# SPDX-License-Identifier: MIT
"""Fast motion: how far an object may move from frame to frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

import sdftrack as st
from experiments.common.protocol import MESHES, load_mesh, load_sdf, summary
from experiments.common.tracked_scene import track_scene
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table

STEP_MM, STEP_DEG = 30.0, 10.0
COLUMNS = {
    "mesh, mode, motion model": "name",
    "mean mm": "mean_mm:.3f",
    "max mm": "max_mm:.2f",
    "mean deg": "mean_deg:.3f",
    "max deg": "max_deg:.2f",
    **{name: f"{name}:d" for name in ("lost", "weak", "wrong")},
    "ms": "ms_per_frame:.2f",
}


@experiment(
    "motion",
    needs=["meshes"],
    chosen_on="lm_driller (the wide attempt of the tracker)",
    reported_on="lm_driller, lm_can, lm_cat, spot; seed 0",
    short={"only": ("spot",), "frames": 5, "voxels": 80},
)
def fast_motion(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    mode: tuple[Literal["depth", "rgbd"], ...] = ("depth", "rgbd"),
    motion: tuple[Literal["static", "constant_velocity", "adaptive"], ...] = (
        "static",
        "constant_velocity",
        "adaptive",
    ),
    seeds: int = 1,
    frames: int = 300,
    step_mm: float = STEP_MM,
    step_deg: float = STEP_DEG,
    sigma: float = 0.001,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """Fast motion: how far an object may move from frame to frame.

    A cluttered table; "lost" counts frames that the tracker calls lost, "wrong" those more than 20 mm or 10 deg off.

    Parameters
    ----------
    motion
        motion models, comma separated
    """
    walk = st.synth.random_walk(step_m=1e-3 * step_mm, step_rad=float(np.deg2rad(step_deg)))
    rows: dict[str, dict[str, Any]] = {}
    for name in only:
        mesh = load_mesh(data, name)
        sdf = load_sdf(mesh, name, voxels, cache)
        sequences = [
            st.synth.sequence(
                mesh, frames, walk, sigma, seed=seed, clutter=True, threads=threads, cache=cache
            )
            for seed in range(seeds)
        ]
        for way in mode:
            for model in motion:
                told = {"motion": model, "threads": threads, **options}
                rows[f"{name}, {way}, {model}"] = summary([track_scene(sdf, s, way, told) for s in sequences])
    title = f"{frames} frames, {step_mm:g} mm and {step_deg:g} deg per frame, noise {1e3 * sigma:g} mm, {seeds} seeds"
    return Table.of(title, COLUMNS, rows)
