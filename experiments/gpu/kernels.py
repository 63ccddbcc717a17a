# SPDX-License-Identifier: MIT
"""How long each kernel takes, and how near it comes to the GPU's limits, by Nsight Compute (`ncu`): one JSON.

    python -m experiments.gpu.kernels --out FILE.json [--device cuda:0]

The tasks of `experiments.gpu.measure` run once to warm up and once more under `ncu`, which times each kernel by itself:
without the transfers, the launches and the host.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import re
import statistics
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

from experiments.gpu.measure import calls

# Time in ns; how busy the memory and the multiprocessors are, in percent of what they can do.
METRICS = {
    "gpu__time_duration.sum": "time_us",
    "dram__throughput.avg.pct_of_peak_sustained_elapsed": "memory_percent",
    "sm__throughput.avg.pct_of_peak_sustained_elapsed": "compute_percent",
}
MOST = 300  # kernels of a task; of each more would say the same


def kernel_of(name: str) -> str:
    """What `ncu` calls ``run_kernel<sdftrack::levelset::Step>(T1)`` is the kernel ``levelset::Step``."""
    found = re.search(r"run_kernel<(.*)>\(", name)
    inner = found[1] if found else name
    inner = re.sub(r"\(anonymous namespace\)::|<unnamed>::|sdftrack::|void ", "", inner)
    return re.sub(r"<.*>", "", inner)


def summary(printed: str) -> dict[str, dict[str, float]]:
    """Of each kernel, its launches and the medians of the metrics, from what ``ncu --csv`` prints."""
    begin = printed.index('"ID"')
    values: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in csv.DictReader(io.StringIO(printed[begin:])):
        key = METRICS.get(row["Metric Name"])
        if key is None:
            continue
        value = float(row["Metric Value"].replace(",", ""))
        in_us = {"ns": 1e-3, "nsecond": 1e-3, "us": 1.0, "usecond": 1.0, "ms": 1e3, "msecond": 1e3}
        values[kernel_of(row["Kernel Name"])][key].append(value * in_us.get(row["Metric Unit"], 1.0))
    return {
        kernel: {"launches": len(of["time_us"]), "all_us": sum(of["time_us"])}
        | {key: statistics.median(numbers) for key, numbers in of.items()}
        for kernel, of in values.items()
    }


def measured(task: str, device: str) -> dict[str, dict[str, float]]:
    """The kernels of one task, run in a process of its own."""
    run = [
        "ncu",
        "--clock-control",
        "none",
        "--csv",
        "--launch-count",
        str(MOST),
        "--metrics",
        ",".join(METRICS),
    ]
    work = [sys.executable, "-m", "experiments.gpu.kernels", "--device", device, "--task", task]
    done = subprocess.run([*run, *work], capture_output=True, text=True, check=False)
    if done.returncode or '"ID"' not in done.stdout:
        raise RuntimeError(f"ncu: {(done.stderr + done.stdout).strip()[-400:]}")
    return summary(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--device", default="cuda:0")
    parser.add_argument("--task", help="run this one twice, and nothing else")
    parser.add_argument("--only", default="", help="the tasks with this in their name")
    given = parser.parse_args()
    tasks = {name: make for name, make in calls(quick=False).items() if given.only in name}
    if given.task is not None:
        call = tasks[given.task](given.device)
        call()
        return
    found = {}
    for task in tasks:
        found[task] = measured(task, given.device)
        print(task)
        for kernel, of in found[task].items():
            print("   ", kernel, {key: round(value, 1) for key, value in of.items()}, flush=True)
    if given.out is not None:
        given.out.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
