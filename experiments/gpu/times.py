# SPDX-License-Identifier: MIT
"""Measured times of the GPU that is here, beside the CPU's, the goals and the least ones on paper."""

from __future__ import annotations

import shutil
from typing import Any

from experiments.gpu.estimates import GPUS, WORK, seconds
from experiments.gpu.kernels import measured
from experiments.gpu.measure import calls, measure
from experiments.registry import experiment
from experiments.table import Table
from sdftrack import _core
from sdftrack.device import device_number

__all__ = ["gpu_times"]

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
