# SPDX-License-Identifier: MIT
"""Section 4.6: time of the parts of a reconstruction at 200^3."""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from experiments.common.bodies import VOXELS
from experiments.pictures import COLORS, Panel, curves
from experiments.progress import step
from experiments.reconstruction.growing import reconstructor, scene_of
from experiments.reconstruction.rebuilt import rebuild
from experiments.registry import experiment
from experiments.table import Table

SIGMA_M, WARM = 0.001, 10
PARTS = {
    "tracking": ("track", "10 ms (100 Hz)"),
    "evidence and level set": ("fuse", "150-200 ms (100 steps), then 15-40 ms (10-20 steps), GTX 680"),
    "shape handed to the tracker": ("reshape", None),
    "all": ("all", None),
}
WAYS = {"": None, ", as printed": 8.0}  # what is added to a part's name; sigma_d, voxels


@experiment(
    "thesis.section.4.6",
    chosen_on="nothing: times",
    reported_on="the built-in duck, seed 0",
    short={"frames": 12},
)
def parts(*, frames: int = 60, mesh: Path | None = None, unit: str | None = None, threads: int = 0) -> Table:
    """Section 4.6: time of the parts of a reconstruction.

    The first frames of Figure 4.13 (b), 1 mm of noise, 640 x 480. Printed: tracking at about 100 Hz on a CPU; a step of
    the level set 1.5 to 2 ms on a GTX 680, about 100 steps on the first frame and 10 to 20 on each later one. Ours
    takes no steps: it adds a frame's evidence and brings the distances up to date where that has changed. "as printed"
    is the thesis' evolution and tracker here, on the CPU (``evolution="printed"``, 100 steps and then 15).

    Parameters
    ----------
    mesh
        instead of the built-in duck
    unit
        of the mesh
    """
    scene = scene_of(mesh, unit, frames, threads)
    seq = scene.frames(SIGMA_M)
    rows: list[dict[str, Any]] = []
    notes = []
    for way, sigma_d in WAYS.items():
        own = _times(reconstructor(scene, seq, sigma_d), seq, frames, way)
        rows += own
        track_hz, all_hz = (1e3 / own[k]["later_ms"] for k in (0, -1))
        notes.append(f"tracking{way} at {track_hz:.0f} Hz, tracking and reconstruction at {all_hz:.1f} Hz")
    columns = {"part": "part", "first frame, ms": "first_ms:.1f", "later, median ms": "later_ms:.1f"}
    return Table.of(
        f"Section 4.6, {frames} frames of {scene.body.name}, {VOXELS} voxels of {1e3 * scene.voxel_m:.2f} mm",
        {**columns, "processor ms": "cpu_ms:.1f", "printed": "printed"},
        rows,
        notes=notes,
        picture=lambda: _picture(rows),
    )


def _times(star: Any, seq: Any, n: int, way: str) -> list[dict[str, Any]]:
    """One row for each part of a run."""
    spent: dict[str, list[float]] = defaultdict(list)

    def told(i: int, result: Any) -> None:
        for part, seconds in star._session.part_seconds.items():
            spent[part].append(seconds or math.nan)
        spent["all"].append(result.seconds)
        step(i + 1, n, f"frames{way}")

    live = rebuild(star, seq, None, n, told)
    return [
        {
            "part": name + way,
            "first_ms": 1e3 * spent[key][0] if math.isfinite(spent[key][0]) else None,
            "later_ms": _median_ms(spent[key]),
            "cpu_ms": _median_ms(list(live.cpu_seconds)) if key == "all" else None,
            "printed": printed,
        }
        for name, (key, printed) in PARTS.items()
    ]


def _median_ms(seconds: list[float]) -> float | None:
    later = np.array(seconds[min(WARM, len(seconds) - 1) :])
    return 1e3 * float(np.nanmedian(later)) if np.isfinite(later).any() else None


def _picture(rows: list[dict[str, Any]]) -> Any:
    fig = curves([[Panel([], {"xlabel": "a frame but the first (ms)"})]], (8.0, 3.6))
    shown = [row for row in rows[::-1] if row["later_ms"] is not None]
    bars = fig.axes[0].barh(
        [row["part"] for row in shown], [row["later_ms"] for row in shown], color=COLORS[0]
    )
    fig.axes[0].bar_label(bars, fmt=" %.1f", fontsize=8)
    return fig
