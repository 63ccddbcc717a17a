# SPDX-License-Identifier: MIT
"""Values of a movement while it happens: speed, path and repetitions so far, from past frames alone."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import numbers
from sdftrack.io.report_file import plain

Array = NDArray[np.float64]
SMOOTHING_S = 0.06  # time constant of position and speed
MOVING_MPS = 0.02  # slower motion adds nothing to the path: noise would
LEAST_AWAY_M = 0.03
AWAY, BACK = 0.5, 0.25  # of the largest distance so far: where a repetition is far out, and where it ends
LONGEST_STEP_S = 0.5  # a longer gap is no movement


@dataclass(frozen=True)
class LiveValues:
    """Running values of one object.

    Attributes
    ----------
    speed_mps, peak_speed_mps : float
        Smoothed speed now, and the largest one so far.
    path_m : float
        Length of the path so far, without what is slower than 20 mm/s.
    distance_m : float
        From where the object was at first.
    repetitions : int
        Times that it went out and came back.
    last_repetition_s : float
        Duration of the last one, beyond a quarter of the largest distance; NaN before the first.
    """

    speed_mps: float
    peak_speed_mps: float
    path_m: float
    distance_m: float
    repetitions: int
    last_repetition_s: float

    def to_dict(self) -> dict[str, float | int | None]:
        """Ready for JSON."""
        return dict(plain(dataclasses.asdict(self)))

    def text(self) -> str:
        """One line for people."""
        line = f"{1e3 * self.speed_mps:.0f} mm/s, path {self.path_m:.2f} m, {self.repetitions} repetitions"
        return line + (
            "" if math.isnan(self.last_repetition_s) else f", the last {self.last_repetition_s:.1f} s"
        )


class LiveMotion:
    """Running values of one object; memory does not grow.

    For feedback while an exercise is done; what is reported afterwards comes from :func:`analyze`, which looks at the
    whole movement and knows its intervals.

    >>> live = LiveMotion()
    >>> for k in range(31):
    ...     values = live.add(k / 30, [0.3 * k / 30, 0, 0.8])
    >>> round(values.speed_mps, 2)
    0.3
    """

    def __init__(self) -> None:
        self._home: Array | None = None
        self._last_s = math.nan
        self._position = np.full(3, np.nan)
        self._velocity = np.zeros(3)
        self._path_m = self._peak_mps = self._largest_m = 0.0
        self._count, self._out, self._left_s, self._duration_s = 0, False, math.nan, math.nan

    def add(self, time_s: float, position_m: ArrayLike | None) -> LiveValues:
        """Take the next position (3,) in metres; None or NaN: the object is not seen in this frame.

        Times that do not increase are ignored, and nothing is added over gaps of more than half a second.
        """
        x = None if position_m is None else numbers(position_m, "position_m")
        if x is not None and x.shape != (3,):
            raise ValueError(f"position_m: expected (x, y, z) in metres, got shape {x.shape}")
        if x is None or not np.isfinite(x).all() or not math.isfinite(time_s):
            return self._values()
        dt = time_s - self._last_s
        if dt <= 0:
            return self._values()
        if self._home is None:
            self._home = x.copy()
        if not dt <= LONGEST_STEP_S:  # the first one, too
            self._position, self._velocity = x.copy(), np.zeros(3)
        else:
            self._move(x, dt)
        self._last_s = time_s
        self._count_repetition(time_s)
        return self._values()

    def _move(self, x: Array, dt: float) -> None:
        gain = 1 - math.exp(-dt / SMOOTHING_S)
        position = self._position + self._velocity * dt
        error = x - position
        # A filter of position and velocity that follows constant velocity without delay, critically damped.
        moved = position + (1 - (1 - gain) ** 2) * error - self._position
        self._position = self._position + moved
        self._velocity = self._velocity + gain**2 / dt * error
        speed = float(np.linalg.norm(self._velocity))
        self._peak_mps = max(self._peak_mps, speed)
        if speed > MOVING_MPS:
            self._path_m += float(np.linalg.norm(moved))

    def _count_repetition(self, time_s: float) -> None:
        away = self._distance()
        self._largest_m = max(self._largest_m, away)
        near = max(BACK * self._largest_m, 0.25 * LEAST_AWAY_M)
        if not self._out and away <= near:
            self._left_s = time_s
        if away > max(AWAY * self._largest_m, LEAST_AWAY_M):
            self._out = True
        elif self._out and away <= near:
            self._out = False
            self._count += 1
            self._duration_s = time_s - self._left_s
            self._left_s = time_s

    def _distance(self) -> float:
        return 0.0 if self._home is None else float(np.linalg.norm(self._position - self._home))

    def _values(self) -> LiveValues:
        speed = float(np.linalg.norm(self._velocity))
        return LiveValues(
            speed, self._peak_mps, self._path_m, self._distance(), self._count, self._duration_s
        )
