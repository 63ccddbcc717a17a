# SPDX-License-Identifier: MIT
"""Every benchmark of tests/bench, and processes of their own: a first import, a track, a reconstruction."""

from __future__ import annotations

import importlib
import sys
import tempfile
from pathlib import Path
from typing import Any

from experiments.progress import step
from experiments.registry import experiment
from experiments.table import Table

BENCH = Path(__file__).resolve().parents[2] / "tests" / "bench"
COLUMNS = {
    "call": "name",
    "median ms": "median_ms:.3g",
    "lower quartile": "lower_ms:.3g",
    "upper quartile": "upper_ms:.3g",
    "runs": "runs:d",
}


@experiment(
    "times",
    needs=["meshes"],
    chosen_on="speed was worked on with lm_driller, a box, a capsule and a ball",
    reported_on="the same bodies; lm_cat reconstructed",
)
def times(*, data: Path, topics: tuple[str, ...] = (), frames: int = 300) -> list[Table]:
    """Median and quartiles of each benchmark; processor time and peak memory of processes.

    One thread unless the name says otherwise. A process that reconstructs reads `frames` images of a turntable,
    640 x 480 with colour and 1 mm of noise, 200 voxels, default options.

    Parameters
    ----------
    topics
        of the benchmarks, such as tracking or planes, or "processes"; none: all
    """
    sys.path.append(str(BENCH))
    harness, processes = (importlib.import_module(name) for name in ("harness", "processes"))
    found: dict[str, list[Any]] = {}
    for bench in harness.all_benchmarks():
        found.setdefault(bench.name.split("/")[0], []).append(bench)
    tables = []
    for topic in topics or (*found, "processes"):
        if topic == "processes":
            rows = process_rows(processes, data / "meshes", frames)
            tables.append(
                Table.of("processes", {"process": "process", "figure": "figure", "value": "value"}, rows)
            )
        else:
            rows = []
            for bench in found[topic]:
                rows.append(vars(harness.measure(bench)))
                step(len(rows), len(found[topic]), topic)
            tables.append(Table.of(topic, COLUMNS, rows))
    return tables


def process_rows(processes: Any, meshes: Path, frames: int) -> list[dict[str, Any]]:
    """A row for each figure of each process."""
    with tempfile.TemporaryDirectory() as folder:
        figures = {
            "import sdftrack": processes.import_figures(),
            "track lm_driller": processes.track_figures(meshes / "lm_driller.ply", folder),
        }
        processes.render(meshes / "lm_cat.ply", folder, frames)
        for threads in (1, 2):
            figures[f"reconstruct lm_cat, {threads} threads"] = processes.reconstruct_figures(
                folder, frames, threads
            )
    return [
        {
            "process": process,
            "figure": name,
            "value": f"{value:.1f}" if isinstance(value, float) else str(value),
        }
        for process, of_it in figures.items()
        for name, value in of_it.items()
    ]
