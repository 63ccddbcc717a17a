# SPDX-License-Identifier: MIT
"""Tracking through a hand that holds the object."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

from experiments.common.protocol import MESHES, load_mesh, load_sdf, say, summary
from experiments.common.tracked_scene import Run, track_scene
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table, cells

# Changing these numbers breaks comparisons with docs/results.md.
SHARE, GROW = 0.6, 30
COLORS: tuple[Literal["other", "similar"], ...] = ("other", "similar")
MEAN_MM, MEAN_DEG, MAX_MM, MAX_DEG = 0.5, 0.5, 1.5, 1.5
COLUMNS = {
    "mesh, hand, mode": "name",
    "hidden %": "hidden_percent:.0f",
    "mean mm": "mean_mm:.3f",
    "max mm": "max_mm:.2f",
    "mean deg": "mean_deg:.3f",
    "max deg": "max_deg:.2f",
    **{name: f"{name}:d" for name in ("lost", "weak", "wrong")},
    "ms": "ms_per_frame:.2f",
    "kept": "kept",
}


def scene(
    mesh: Any,
    frames: int,
    seed: int,
    *,
    share: float = SHARE,
    grow: int = GROW,
    color: str = "other",
    sigma_m: float = 0.001,
    noise: str = "gaussian",
    threads: int = 0,
    cache: Path | None = None,
) -> Any:
    """The sequence of one row and seed."""
    from sdftrack import synth

    held = None if share == 0 else synth.Grip(share, color, grow=grow)
    model = sigma_m if noise == "gaussian" else {"kinect": synth.Kinect, "stereo": synth.Stereo}[noise]()
    return synth.sequence(
        mesh, frames, noise=model, occluder=held, seed=seed, clutter=True, threads=threads, cache=cache
    )


def kept(row: dict[str, Any]) -> bool:
    """Whether a row is within what is asked for."""
    return bool(
        row["lost"] == 0
        and row["wrong"] == 0
        and row["mean_mm"] <= MEAN_MM
        and row["mean_deg"] <= MEAN_DEG
        and row["max_mm"] <= MAX_MM
        and row["max_deg"] <= MAX_DEG
    )


@experiment(
    "occlusion",
    needs=["meshes"],
    chosen_on="the first 60 frames with the cat (colour likelihood); the rest on other scenes",
    reported_on="lm_driller, lm_can, lm_cat, spot; seed 0",
    short={"only": ("spot",), "color": ("other",), "mode": ("rgbd",), "frames": 8, "grow": 4, "voxels": 80},
)
def occlusion(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    mode: tuple[Literal["depth", "rgbd"], ...] = ("depth", "rgbd"),
    color: tuple[Literal["other", "similar", "skin"], ...] = COLORS,
    share: float = SHARE,
    grow: int = GROW,
    seeds: int = 1,
    frames: int = 300,
    sigma: float = 0.001,
    noise: Literal["gaussian", "kinect", "stereo"] = "gaussian",
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """Tracking through a hand that holds the object, of another colour and of the object's own colours.

    5 mm and 1.5 deg per frame over a cluttered table. Within the first second a hand closes around the object; from
    then on its fingers hide 60 % of what would be visible, in contact with the surface.

    Parameters
    ----------
    color
        of the hand
    share
        of the visible object that is hidden
    noise
        gaussian: of `sigma`; kinect: as structured light errs; stereo: as a pair of cameras does
    grow
        frames in which the hand closes
    """
    rows: dict[str, dict[str, Any]] = {}
    for name in only:
        mesh = load_mesh(data, name)
        sdf = load_sdf(mesh, name, voxels, cache)
        for hand in color:
            sequences = [
                scene(
                    mesh,
                    frames,
                    seed,
                    share=share,
                    grow=grow,
                    color=hand,
                    sigma_m=sigma,
                    noise=noise,
                    threads=threads,
                    cache=cache,
                )
                for seed in range(seeds)
            ]
            hidden = 100 * float(np.mean([_hidden(s, mesh, threads) for s in sequences]))
            for way in mode:
                told = {"threads": threads, **options}
                runs: list[Run] = [track_scene(sdf, s, way, told) for s in sequences]
                row = {**summary(runs), "hidden_percent": hidden}
                row["kept"] = kept(row)
                rows[f"{name}, {hand}, {way}"] = row
                say("  ".join(cells(COLUMNS, {"name": f"{name}, {hand}, {way}", **row})))
    said = {"kinect": "a Kinect's noise", "stereo": "noise of stereo"}.get(noise, f"noise {1e3 * sigma:g} mm")
    title = f"{frames} frames, {said}, a hand that hides {100 * share:g} %, {seeds} seeds"
    return Table.of(title, COLUMNS, rows)


def _hidden(seq: Any, mesh: Any, threads: int) -> float:
    """Share of the object that the hand hides in the last frame."""
    i = len(seq) - 1
    bare = mesh.raycast(seq.camera, seq.ground_truth[i][0], threads=threads)[0] > 0
    return 1 - np.count_nonzero(seq.masks(i)[0]) / np.count_nonzero(bare)
