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

import importlib
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

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


def all_benchmarks() -> list[Benchmark]:
    """Those of all files beside this one."""
    here = Path(__file__).resolve()
    sys.path.append(str(here.parents[2]))  # some take the settings of an experiment
    for path in sorted(here.parent.glob("bench_*.py")):
        importlib.import_module(path.stem)
    return REGISTERED


@dataclass(frozen=True)
class Timed:
    name: str
    median_ms: float
    lower_ms: float  # quartiles
    upper_ms: float
    runs: int
    per_item: str

    def __str__(self) -> str:
        return (
            f"{self.name:40} {self.median_ms:8.3f}ms {self.lower_ms:9.3f}..{self.upper_ms:8.3f}ms "
            f"{self.runs:5d}  {self.per_item}"
        )


def measure(bench: Benchmark) -> Timed:
    """Median and spread of one benchmark."""
    run = bench.setup()
    for _ in range(WARM_UP):
        run()
    seconds: list[float] = []
    while len(seconds) < MIN_RUNS or (len(seconds) < MAX_RUNS and sum(seconds) < MIN_SECONDS):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    lower, median, upper = (1e3 * s for s in statistics.quantiles(seconds, n=4))
    return Timed(
        bench.name, median, lower, upper, len(seconds), f"{1e6 * median / bench.items:.1f} ns/{bench.unit}"
    )
