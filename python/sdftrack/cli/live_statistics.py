# SPDX-License-Identifier: MIT
"""Counts and latencies of a live run, in constant memory."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

import numpy as np

from sdftrack.cli.track_summary import StatusCounts

__all__ = ["LiveStatistics"]

KEPT = 4096  # ages of the newest frames, for the percentiles


class LiveStatistics:
    """Counts of results by status, and the age of the newest ones."""

    def __init__(self, objects: int) -> None:
        self.frames = 0
        self.followed = [0] * objects  # frames in which an object was "ok" or "weak"
        self._counts = StatusCounts()
        self._ages_s: deque[float] = deque(maxlen=KEPT)

    def add(self, result: Any, age_s: float) -> None:
        self.frames += 1
        self._counts.add(result)
        for k, status in enumerate(result.status):
            self.followed[k] += str(status) in ("ok", "weak")
        if math.isfinite(age_s):
            self._ages_s.append(age_s)

    def age_ms(self, percent: float) -> float:
        """Percentile of the age of results; NaN without timestamps."""
        return 1e3 * float(np.percentile(self._ages_s, percent)) if self._ages_s else math.nan

    def line(self, seconds: float, camera: Any) -> str:
        parts = [f"{self.frames} frames", f"{self.frames / max(seconds, 1e-9):.1f}/s"]
        if self._ages_s:
            parts.append(f"{self.age_ms(50):.1f} ms old (99 %: {self.age_ms(99):.1f})")
        parts += [f"{camera.dropped} dropped", self._counts()]
        return ", ".join(p for p in parts if p)
