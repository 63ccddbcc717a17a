# SPDX-License-Identifier: MIT
"""Many steps of every class that keeps something between calls: do memory and the time of a step stay the same?"""

from __future__ import annotations

import gc
import multiprocessing
import os
import statistics
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from experiments.registry import experiment
from experiments.robustness.soak_cases import CASES
from experiments.table import Table


@dataclass(frozen=True)
class Soaked:
    """Memory after a tenth of the steps and at the end, MB; time of a step in the first and last tenth, median, us."""

    early_mb: float
    late_mb: float
    early_us: float
    late_us: float


@experiment(
    "soak",
    chosen_on="nothing was chosen",
    reported_on="a rendered box, images of 64 x 48 pixels",
    short={"steps": 200, "only": "LiveMotion"},
)
def soak(*, steps: int = 100_000, only: str = "") -> Table:
    """Memory and time of many steps of every class that keeps something between calls.

    Each case has a process of its own. Memory is the resident memory of this process, time the processor time of all
    its threads (median over the steps).

    Parameters
    ----------
    steps
        of each case
    only
        the cases whose name contains this text
    """
    rows, numbers = [], {}
    for name in CASES:
        if only not in name:
            continue
        found = soaked(name, steps)
        numbers[name] = [found.early_mb, found.late_mb, found.early_us, found.late_us]
        rows.append(
            [
                name, f"{steps:,}", f"{found.early_mb:.1f}", f"{found.late_mb:.1f}",
                f"{found.late_mb - found.early_mb:.1f}", f"{found.early_us:.0f}", f"{found.late_us:.0f}",
                f"{100 * (found.late_us / found.early_us - 1):+.0f}",
            ]
        )  # fmt: skip
        print(*rows[-1], sep=" | ", flush=True)
    columns = [
        "class", "steps", "MB after a tenth", "MB at the end", "growth MB", "first tenth us", "last tenth us",
        "slower by %",
    ]  # fmt: skip
    return Table("Long runs", columns, rows, numbers=numbers)


def soaked(name: str, steps: int) -> Soaked:
    """What a case measures in a new process, in which no other has left memory that it could use."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_run, (name, steps))


def _run(name: str, steps: int) -> Soaked:
    tenth = max(1, steps // 10)
    early: list[int] = []
    late: list[int] = []
    with ExitStack() as stack:
        step = CASES[name](stack)
        early_mb = 0.0
        for k in range(steps):
            began = time.process_time_ns()
            step(k)
            taken = time.process_time_ns() - began
            if k < tenth:
                early.append(taken)
            elif k >= steps - tenth:
                late.append(taken)
            if k == tenth:
                early_us = 1e-3 * statistics.median(early)
                late = [0] * len(early)  # the list of the last tenth has its memory from here on
                late.clear()
                early_mb = resident_mb()
        late_mb = resident_mb()
    return Soaked(early_mb, late_mb, early_us, 1e-3 * statistics.median(late))


def resident_mb() -> float:
    """Resident memory of this process."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
