# SPDX-License-Identifier: MIT
"""Time of a call, repeated until it is known."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

__all__ = ["PER_SEGMENT_PX", "times_ms"]

PER_SEGMENT_PX = 256  # 1,200 segments at 640 x 480
Run = Callable[[], object]


def times_ms(run: Run, seconds: float = 2.0, least: int = 5) -> tuple[float, float, float]:
    """Best and median time of a call, and the least time of all processors, which a busy machine moves least."""
    run()
    taken: list[float] = []
    work: list[float] = []
    while len(taken) < least or sum(taken) < 1e3 * seconds:
        began, before = time.perf_counter(), time.process_time()
        run()
        taken.append(1e3 * (time.perf_counter() - began))
        work.append(1e3 * (time.process_time() - before))
    return min(taken), float(np.median(taken)), min(work)
