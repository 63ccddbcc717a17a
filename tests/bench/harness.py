# SPDX-License-Identifier: MIT
"""Timing that can be compared from one month to the next.

A benchmark file is ``bench_<topic>.py``, which names its benchmarks by :func:`benchmark`. Each is a set-up that returns
the function to time, with what the figure refers to::

    def start():
        tracker, frame, pose = ...
        return lambda: tracker.start(frame, poses=[pose])

    benchmark("tracking/start", start, unit="start")

Sizes, seeds, warm-up and repeats are fixed: changing these numbers breaks comparisons. Give a changed
benchmark a new name instead.
"""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

WARM_UP = 2  # runs that are not counted: caches, page faults, the clock of the CPU
MIN_RUNS = 5  # the median of fewer says little
MAX_RUNS = 200
MIN_SECONDS = 1.0  # short functions are repeated until they fill this


@dataclass(frozen=True)
class Benchmark:
    name: str
    setup: Callable[[], Callable[[], object]]
    items: int  # pixels, voxels, frames ... that one run works on; 1 if the run itself is the item
    unit: str


REGISTERED: list[Benchmark] = []


def benchmark(
    name: str, setup: Callable[[], Callable[[], object]], items: int = 1, unit: str = "run"
) -> None:
    """Register a set-up function that returns what is to be timed."""
    REGISTERED.append(Benchmark(name, setup, items, unit))


def measure(bench: Benchmark) -> dict[str, object]:
    """Median and spread of one benchmark, seconds per run."""
    run = bench.setup()
    for _ in range(WARM_UP):
        run()
    seconds: list[float] = []
    while len(seconds) < MIN_RUNS or (len(seconds) < MAX_RUNS and sum(seconds) < MIN_SECONDS):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    lower, median, upper = statistics.quantiles(seconds, n=4)
    return {
        "name": bench.name,
        "median_s": median,
        "quartiles_s": [lower, upper],
        "fastest_s": min(seconds),
        "runs": len(seconds),
        "items": bench.items,
        "unit": bench.unit,
        "median_ns_per_item": 1e9 * median / bench.items,
    }


def machine() -> dict[str, object]:
    """What the figures were taken on."""
    return {
        "cpu": cpu_name(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": platform.platform(),
        "python": platform.python_version(),
    }


def cpu_name() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()
