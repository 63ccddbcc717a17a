# SPDX-License-Identifier: MIT
"""Measured times of the GPU that is here, beside the CPU's, the goals and the least ones on paper.

    python -m experiments.gpu.times --out FOLDER [--device cuda:0] [--quick]

writes the record of the experiment, gpu_times.json, after each task: what a run that is cut off has measured is there.
--quick: small sizes and single runs, to try the script itself.
"""

from __future__ import annotations

import argparse
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments import record
from experiments.gpu.estimates import GPUS, WORK, seconds
from experiments.gpu.kernels import measured
from experiments.gpu.measure import calls, measure
from experiments.registry import experiment
from experiments.table import Table
from sdftrack import _core
from sdftrack.device import device_number

__all__ = ["gpu_times", "main"]

NOTE = "Medians, with the copies to the GPU and back, and Python."


@experiment(
    "gpu_times",
    chosen_on="nothing was chosen",
    reported_on="rendered scenes and random numbers",
    short={"quick": True},
)
def gpu_times(*, device: str = "cuda", quick: bool = False) -> list[Table]:
    """Times of each task on a GPU and on the CPU; with Nsight Compute (`ncu`), also of each kernel."""
    number = device_number(device)
    name = _core.cuda_device_name(number)
    times = measure(f"cuda:{number}", quick)
    tables = [_times(name, times)]
    if not quick and shutil.which("ncu"):
        tables.append(_kernels(name, f"cuda:{number}"))
    return tables


def _times(name: str, times: dict[str, Any]) -> Table:
    paper = {work.name: (work.goal_ms, 1e3 * seconds(work, GPUS[0])[0]) for work in WORK}
    rows = []
    for task, of in times.items():
        goal, least = paper.get(task, (None, None))
        gpu = of["gpu_ms"]
        rows.append(
            [
                task,
                f"{of['cpu_ms']['median']:.2f}",
                f"{gpu['median']:.2f}",
                "" if goal is None else f"{goal:g}",
                "" if least is None else f"{least:.3f}",
            ]
        )
    columns = ["task", "CPU ms", "GPU ms", "goal ms", f"on paper, {GPUS[0].name} ms"]
    return Table(f"Times on an {name}", columns, rows, [NOTE], times)


def _kernels(name: str, device: str) -> Table:
    columns = ["kernel", "launches", "median µs", "all µs", "memory %", "compute %"]
    rows: list[list[str]] = []
    for task in calls(quick=False):
        for kernel, of in measured(task, device).items():
            rows.append(
                [
                    f"{task}: {kernel}",
                    f"{of['launches']:.0f}",
                    f"{of['time_us']:.1f}",
                    f"{of['all_us']:.0f}",
                    f"{of['memory_percent']:.0f}",
                    f"{of['compute_percent']:.0f}",
                ]
            )
    note = "By Nsight Compute, each kernel alone: the first 300 of a task; percent of what the GPU can do."
    return Table(f"Kernels on an {name}", columns, rows, [note])


def main(given: Sequence[str] | None = None) -> None:
    """The times alone, recorded task by task."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--out", type=Path, metavar="FOLDER", required=True)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args(given)
    asked.out.mkdir(parents=True, exist_ok=True)
    number = device_number(asked.device)
    name = _core.cuda_device_name(number)
    settings = {"device": asked.device, "quick": asked.quick}
    began = time.perf_counter()

    def keep(times: dict[str, Any]) -> None:
        seconds_so_far = time.perf_counter() - began
        record.save("gpu_times", settings, [_times(name, times).to_dict()], seconds_so_far, folder=asked.out)

    measure(f"cuda:{number}", asked.quick, keep)


if __name__ == "__main__":
    main()
