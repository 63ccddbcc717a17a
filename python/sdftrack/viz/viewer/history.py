# SPDX-License-Identifier: MIT
"""What the page shows over time: positions and confidences of the last minutes, and the frame rate."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

KEPT = 600  # frames: 20 s at 30 Hz
RATE_FRAMES = 30


class History:
    """The last frames of one run; kept while no page is open, so that a page shows them when it opens."""

    def __init__(self) -> None:
        self._rows: deque[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = deque(maxlen=KEPT)
        self._times: deque[float] = deque(maxlen=RATE_FRAMES)
        self._began: float | None = None
        self._filled = False
        self._lock = threading.Lock()

    def add(self, result: Any) -> None:
        """Add a frame's result (None: a frame without one)."""
        now = time.monotonic()
        with self._lock:
            self._began = now if self._began is None else self._began
            self._times.append(now)
            if result is not None and not self._filled:
                self._rows.append(_row(now - self._began, result))

    def fill(self, results: Sequence[Any]) -> None:
        """The results of a finished run, over the number of the frame; later ones are not added."""
        rows = [_row(float(i), result) for i, result in enumerate(results) if result is not None]
        with self._lock:
            self._rows, self._filled = deque(rows), True

    def rate_hz(self) -> float | None:
        """Frames per second of the last frames; None before the second."""
        with self._lock:
            if len(self._times) < 2 or self._times[-1] == self._times[0]:
                return None
            return (len(self._times) - 1) / (self._times[-1] - self._times[0])

    def positions(self, k: int) -> NDArray[np.float64]:
        """(N, 3) m, NaN where object `k` was lost or not there."""
        with self._lock:
            rows = list(self._rows)
        gone = np.full(3, np.nan)
        return np.array([p[k] if k < len(p) else gone for _, p, _ in rows]).reshape(-1, 3)

    def confidences(self, count: int) -> tuple[NDArray[np.float64], ...]:
        """Times (s since the first frame; in a finished run the numbers of frames), and confidences of `count` objects.

        NaN where unknown.
        """
        with self._lock:
            rows = list(self._rows)
        times = np.array([t for t, _, _ in rows], np.float64)
        return times, *(
            np.array([c[k] if k < len(c) else np.nan for _, _, c in rows], np.float64) for k in range(count)
        )


def _row(at: float, result: Any) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    known = np.array([str(s) in ("ok", "weak") for s in result.status])
    return at, np.where(known[:, None], result.poses[:, :3, 3], np.nan), np.array(result.confidence)
