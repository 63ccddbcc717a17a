# SPDX-License-Identifier: MIT
"""The source's STAR3D, part by part, beside this project's reconstruction."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments.common.protocol import say
from experiments.reconstruction.reconstruction import PARTS, Setting, run_case
from experiments.registry import experiment
from experiments.table import Table, cells

WAYS: dict[str, dict[str, Any]] = {
    "ours": {},
    "printed evidence": {"evidence": "printed"},
    "printed": {"evolution": "printed"},
}
COLUMNS = {
    "case": "name",
    "mean mm": "mean_mm:.2f",
    "max mm": "max_mm:.2f",
    "mean deg": "mean_deg:.2f",
    "max deg": "max_deg:.2f",
    "not ok": "not_ok:d",
    "chamfer mm": "chamfer_mm:.2f",
    "too large by mm": "offset:+.2f",
    "ms": "cpu_ms:.0f",
}


@experiment(
    "reconstruction.evolution",
    needs=["meshes"],
    chosen_on="nothing here: the ball that the printed evolution begins with was chosen on the built-in duck",
    reported_on="bunny, lm_can, lm_duck, spot; hand, seed 1",
    short={"only": ("spot",), "frames": 3, "voxels": 48},
)
def evolution(
    *,
    data: Path,
    only: tuple[str, ...] = ("bunny", "lm_can", "lm_duck", "spot"),
    frames: int = 100,
    voxels: int = 128,
    noise: str = "1mm",
    threads: int = 0,
    cache: Path | None = None,
) -> Table:
    """The source's reconstruction as printed, its evidence alone, and ours, on the same frames.

    The path "hand" of the experiment ``reconstruction``, from the first frame's mask. "printed" is
    ``evolution="printed"`` with its tracker, "printed evidence" all ours but for Eqs. 4.29 to 4.31. Chamfer is the mean
    of both directions, over the part that the frames have shown; "ms" is the processor time of a frame.

    Parameters
    ----------
    noise
        "kinect" or millimetres as in "1mm"
    """
    rows: dict[str, Any] = {}
    for name in only:
        for way, options in WAYS.items():
            seed = PARTS["choose"][1]
            s = Setting(data, frames, "rgbd", voxels, threads, options, False, False, cache, seed)
            (row,) = run_case(name, "hand", noise, s).values()
            case = f"{name}, {way}"
            rows[case] = {k: v for k, v in row.items() if not isinstance(v, list)}  # frame by frame: too long
            say("  ".join(cells(COLUMNS, {"name": case, **row})))
    return Table.of(f"{frames} frames by hand, {noise}, {voxels} voxels", COLUMNS, rows)
