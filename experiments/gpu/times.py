# SPDX-License-Identifier: MIT
"""Measured times of the GPU that is here, beside the CPU's and the goals.

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
from experiments.gpu.kernels import measured
from experiments.gpu.measure import calls, measure
from experiments.registry import experiment
from experiments.table import Table
from sdftrack import _core
from sdftrack.device import device_number

GOALS_MS = {
    "one object, a frame": 0.3,
    "100 objects, a frame": 10.0,
    "two objects that touch, a frame": 0.5,
    "tracker with brightness and outline, a frame": 0.5,
    "reconstruction of 200^3, a frame": 2.0,
    "reconstruction of 200^3, a frame without a mask": 2.0,
    "superpixels, 640 x 480": 0.25,
    "LWPR, 10^6 predictions": 5.0,
    "pose search in a mask": 5.0,
    "ray casting, 640 x 480": 1.0,
    "ray casting of a mesh, 640 x 480": 1.0,
    "mesh of a volume of 200^3": 5.0,
    "distances of a field of 200^3": 10.0,
    "LWPR, 10^4 updates of 50 outputs": 500.0,
}
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
    rows = [
        {
            "task": task,
            "cpu_ms": of["cpu_ms"]["median"],
            "gpu_ms": of["gpu_ms"]["median"],
            "goal_ms": GOALS_MS.get(task, ""),
        }
        for task, of in times.items()
    ]
    columns = {"task": "task", "CPU ms": "cpu_ms:.2f", "GPU ms": "gpu_ms:.2f", "goal ms": "goal_ms:g"}
    return Table.of(f"Times on an {name}", columns, rows, notes=[NOTE], numbers=times)


def _kernels(name: str, device: str) -> Table:
    columns = {
        "kernel": "kernel",
        "launches": "launches:.0f",
        "median µs": "time_us:.1f",
        "all µs": "all_us:.0f",
    }
    columns |= {"memory %": "memory_percent:.0f", "compute %": "compute_percent:.0f"}
    rows = [
        {"kernel": f"{task}: {kernel}", **of}
        for task in calls(quick=False)
        for kernel, of in measured(task, device).items()
    ]
    note = "By Nsight Compute, each kernel alone: the first 300 of a task; percent of what the GPU can do."
    return Table.of(f"Kernels on an {name}", columns, rows, notes=[note])


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
