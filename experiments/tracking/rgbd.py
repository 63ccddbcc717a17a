# SPDX-License-Identifier: MIT
"""RGB-D tracking beside depth alone, on the same rendered frames."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np

from experiments.common.protocol import MESHES, load_mesh, load_sdf, say, summary
from experiments.common.tracked_scene import Run, track_scene
from experiments.common.truth import Truth
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table, cells
from experiments.tracking.synthetic import paths
from sdftrack import synth

WAYS: dict[str, tuple[str, dict[str, Any]]] = {
    "depth": ("depth", {}),
    "odds": ("rgbd", {"color_likelihood": "odds"}),
    "printed": ("rgbd", {"color_likelihood": "printed"}),
}
COLUMNS = {
    "mesh, sigma mm, way": "name",
    "mean mm": "mean_mm:.4f",
    "max mm": "max_mm:.3f",
    "mean deg": "mean_deg:.4f",
    "max deg": "max_deg:.3f",
    **{
        f"x {what} {unit}": f"times_{what}_{unit}:.3f"
        for what in ("bound", "depth")
        for unit in ("mm", "deg")
    },
    **{name: f"{name}:d" for name in ("lost", "weak", "wrong")},
    "ms": "ms_per_frame:.2f",
}


@experiment(
    "rgbd",
    needs=["meshes"],
    chosen_on="the same four meshes and the hand of `occlusion`",
    reported_on="lm_driller, lm_can, lm_cat, spot before clutter; seed 0",
    short={"only": ("spot",), "frames": 5, "voxels": 80},
)
def rgbd(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    ways: tuple[Literal["depth", "odds", "printed"], ...] = ("depth", "odds", "printed"),
    sigma: tuple[float, ...] = (0.001,),
    seeds: int = 1,
    frames: int = 300,
    step_mm: float = 5.0,
    step_deg: float = 1.5,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """RGB-D tracking beside depth alone, on the same rendered frames, against the depth-only bound.

    The objects and paths of `synthetic` before a wall, a table and ten things of random colours, with the meshes' own
    colours. The way "depth" uses no colours, "odds" and "printed" are the two likelihoods (docs/math/color.md).

    Parameters
    ----------
    ways
        of using the colours, comma separated
    sigma
        depth noise, m; several, comma separated
    """
    rows: dict[str, dict[str, Any]] = {}
    told = {"threads": threads, **options}
    with tempfile.TemporaryDirectory() as own:
        for name in only:
            mesh = load_mesh(data, name)
            sdf = load_sdf(mesh, name, voxels, cache)
            truths = paths(mesh, seeds, frames, step_mm, step_deg, threads, cache)
            for s in sigma:
                found = _compared(mesh, sdf, truths, s, ways, told, cache or Path(own))
                for way, row in found.items():
                    key = f"{name} {1e3 * s:.2f} {way}"
                    rows[key] = row
                    say("  ".join(cells(COLUMNS, {"name": key, **row})))
    title = f"{frames} frames, {step_mm:g} mm and {step_deg:g} deg per frame, {seeds} seeds, clutter"
    return Table.of(title, COLUMNS, rows)


def _compared(
    mesh: Any,
    sdf: Any,
    truths: list[Truth],
    sigma_m: float,
    ways: tuple[str, ...],
    told: dict[str, Any],
    cache: Path,
) -> dict[str, dict[str, Any]]:
    """A row for each way over all seeds, beside the bound and beside depth alone."""
    runs: dict[str, list[Run]] = {way: [] for way in ways}
    for seed, truth in enumerate(truths):
        seq = synth.sequence(
            mesh, len(truth), truth.poses, sigma_m, seed=seed, camera=truth.camera, clutter="objects",
            threads=told["threads"], cache=cache,
        )  # fmt: skip
        for way in ways:
            mode, more = WAYS[way]
            runs[way].append(track_scene(sdf, seq, mode, {**told, **more}))
    rows = {way: summary(some) for way, some in runs.items()}
    bounds = {
        "mm": 1e3 * sigma_m * float(np.mean([t.bound_m.mean() for t in truths])),
        "deg": float(np.rad2deg(sigma_m * np.mean([t.bound_rad.mean() for t in truths]))),
    }
    for row in rows.values():
        for unit, bound in bounds.items():
            depth = rows["depth"][f"mean_{unit}"] if "depth" in rows else np.nan
            row[f"times_bound_{unit}"] = row[f"mean_{unit}"] / bound
            row[f"times_depth_{unit}"] = row[f"mean_{unit}"] / depth
    return rows
