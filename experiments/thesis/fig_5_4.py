# SPDX-License-Identifier: MIT
"""Figure 5.4: time of a frame against the number of objects.

Set-up: copies of one shape side by side in contact, all in one image of 640 x 480, depth with 1 mm of noise, one
thread. Printed: linear growth, 30 Hz kept up to 5 objects (CPU).
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from experiments.thesis import Context
from experiments.thesis.look_alikes import name_of, pair_of
from experiments.thesis.measures.growth import fit_text, growth, time_row
from sdftrack.evaluation.tables import text_table

__all__ = ["run"]

COUNTS, FRAMES = (1, 2, 3, 5, 10, 20), 40
HEAD = ["objects", "pixels", "joint ms", "Hz", "single ms", "lost", "printed"]
PRINTED = "linear growth, 30 Hz kept up to 5 objects"


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    mesh, solid = pair_of(context)
    frames = FRAMES if context.frames is None else max(context.frames, 3)
    options = {**context.options, "threads": context.options.get("threads") or 1}
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        for k, count in enumerate(COUNTS):
            made = {
                way: time_row(mesh, solid, count, way, "depth", frames, options, cache=Path(cache))
                for way in ("joint", "single")
            }
            rows.append(
                {
                    "objects": count,
                    "pixels": made["joint"]["pixels"],
                    "joint_ms": made["joint"]["ms_per_frame"],
                    "single_ms": made["single"]["ms_per_frame"],
                    "lost": made["joint"]["lost"],
                }
            )
            context.step(k + 1, len(COUNTS), f"{count} objects")
    fits = {way: growth(COUNTS, [r[f"{way}_ms"] for r in rows]) for way in ("joint", "single")}
    title = f"Figure 5.4, {frames} frames of copies of {name_of(context)}, one thread"
    cells = [
        [
            str(r["objects"]), str(r["pixels"]), f"{r['joint_ms']:.2f}", f"{1e3 / r['joint_ms']:.0f}",
            f"{r['single_ms']:.2f}", str(r["lost"]), "30 Hz" if r["objects"] <= 5 else "-",
        ]
        for r in rows
    ]  # fmt: skip
    notes = [f"printed: {PRINTED}", *(f"{way}: {fit_text(fit)}" for way, fit in fits.items())]
    write_text(context.out / "table.txt", "\n".join([text_table(title, HEAD, cells), *notes]) + "\n")
    _plot(context.out / "figure.png", rows, fits)
    return {"title": title, "head": HEAD, "rows": cells, "notes": notes, "levels": rows, "fits": fits}


def _plot(path: Any, rows: list[dict[str, Any]], fits: dict[str, dict[str, float]]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, ax = figure(size=(7.0, 4.5))
    m = np.array([r["objects"] for r in rows], float)
    for way, label, color in (
        ("joint", "one tracker of all", COLORS[0]),
        ("single", "a tracker each", COLORS[1]),
    ):
        ax.plot(m, [r[f"{way}_ms"] for r in rows], "o", color=color, label=label)
        ax.plot(m, fits[way]["fixed_ms"] + fits[way]["ms_per_object"] * m, "-", color=color, linewidth=1)
    ax.axhline(1e3 / 30, color="0.6", linestyle=":", label="30 Hz")
    ax.set_xlabel("objects")
    ax.set_ylabel("time per frame (ms)")
    ax.set_ylim(bottom=0)
    ax.legend(fontsize=8)
    save_figure(fig, path)
