# SPDX-License-Identifier: MIT
"""Running values of an exercise while it is tracked: causal, in constant memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import number
from sdftrack.motion.trajectory import USABLE

__all__ = ["LiveMotion"]

Array = NDArray[np.float64]
MEMORY_S = 0.08  # of the filter of position and velocity
GAP_S = 0.3  # longer times without a pose: the filter starts anew, and nothing is added to the path
HOME_S = 0.3  # the place at the start is the mean over this time
STEP_M = 0.005  # the path grows in steps of this length: noise at rest adds nothing
LEAVES_M, LEAVES_RAD = 0.03, math.radians(10)  # what counts as having left the start, as for recordings
NEAR = 0.35  # of a repetition's excursion: back at the start
SLOW_PART, SLOW_MPS, SLOW_RADPS = 0.05, 0.02, 0.2  # of its peak speed, at least: the object rests


class LiveMotion:
    """Counts repetitions and follows path and speed of each object, one frame after another.

    The values are first answers while a person moves: without intervals, and by a filter that looks back only. Those of
    :func:`sdftrack.motion.analyze` use the whole recording.

    Parameters
    ----------
    names : sequence of str
        Of the objects, in the order of the results.
    by : "position" or "rotation"
        What a repetition is counted by: 30 mm or 10 degrees and more from the start, and back.

    Examples
    --------
    >>> live = LiveMotion(["cup"])
    >>> live.add(tracker.track(frame))["cup"]["repetitions"]  # doctest: +SKIP
    0
    """

    def __init__(self, names: Sequence[str], *, by: str = "position") -> None:
        if isinstance(names, str) or not len(names) or len(set(names)) != len(names):
            raise ValueError(f"names: expected a different name for each object, got {names!r}")
        if by not in ("position", "rotation"):
            raise ValueError(f"by: expected position or rotation, got {by!r}")
        self._objects = {str(name): _Object(by) for name in names}

    def add(self, result: Any) -> dict[str, dict[str, Any]]:
        """Values after one more frame, ready for JSON.

        Parameters
        ----------
        result : TrackResult
            With a timestamp, later than that of the frame before; an earlier one is ignored.

        Returns
        -------
        dict
            By name: ``repetitions`` (completed), ``path_length_m``, ``speed_mps`` (None while it is not seen),
            ``peak_speed_mps``, ``last_repetition_s`` (None before the first).
        """
        if result.timestamp is None:
            raise ValueError("result: expected a timestamp in seconds, got None")
        if len(result.status) != len(self._objects):
            raise ValueError(
                f"result: expected {len(self._objects)} objects, as names, got {len(result.status)}"
            )
        time = number(result.timestamp, "timestamp")
        for k, one in enumerate(self._objects.values()):
            pose = result.poses[k] if str(result.status[k].value) in USABLE else None
            one.add(time, pose)
        return {name: one.values() for name, one in self._objects.items()}


class _Object:
    """One object: a filter of position and velocity, the path, and the repetition that is under way."""

    def __init__(self, by: str) -> None:
        self._by = by
        self._leaves, self._slow = (LEAVES_M, SLOW_MPS) if by == "position" else (LEAVES_RAD, SLOW_RADPS)
        self._R, self._turn = np.eye(3), np.zeros(3)  # rad/s, reference frame
        self._time = self._first = math.nan
        self._x, self._v = np.zeros(3), np.zeros(3)
        self._seen = False
        self._anchor = np.zeros(3)
        self._home: tuple[Array, Array] | None = None
        self._sum, self._count = np.zeros(3), 0
        self.path_m = self.peak_mps = 0.0
        self.repetitions, self.last_s = 0, math.nan
        self._farthest = self._fastest = 0.0
        self._nearest = math.inf
        self._usual = 0.0  # peak speed of the last repetition
        self._start_at_rest()

    def values(self) -> dict[str, Any]:
        speed = float(np.linalg.norm(self._v))
        return {
            "repetitions": self.repetitions,
            "path_length_m": self.path_m,
            "speed_mps": speed if self._seen else None,
            "peak_speed_mps": self.peak_mps,
            "last_repetition_s": self.last_s if math.isfinite(self.last_s) else None,
        }

    def add(self, time: float, pose: Array | None) -> None:
        if pose is None or not np.isfinite(pose).all():
            self._seen = False
            return
        step = time - self._time
        if step <= 0:
            return
        self._seen = True
        x = pose[:3, 3]
        if not step <= GAP_S:  # also at first, where it is NaN
            self._x, self._v, self._anchor, self._turn = x.copy(), np.zeros(3), x.copy(), np.zeros(3)
        else:
            self._filter(x, step)
            fading = math.exp(-step / MEMORY_S)
            self._turn = fading * self._turn + (1 - fading) * _small_turn(pose[:3, :3] @ self._R.T) / step
        self._R = pose[:3, :3].copy()
        self._time = time
        if self._home is None:
            self._find_home(time, pose)
        else:
            self._follow(time, pose)

    def _filter(self, x: Array, step: float) -> None:
        """A critically damped alpha-beta filter: position and velocity of the fading memory of a line."""
        theta = math.exp(-step / MEMORY_S)
        ahead = self._x + step * self._v
        error = x - ahead
        self._x = ahead + (1 - theta**2) * error
        self._v = self._v + (1 - theta) ** 2 / step * error
        moved = float(np.linalg.norm(self._x - self._anchor))
        if moved >= STEP_M:
            self.path_m += moved
            self._anchor = self._x.copy()

    def _find_home(self, time: float, pose: Array) -> None:
        if math.isnan(self._first):
            self._first = time
        self._sum, self._count = self._sum + pose[:3, 3], self._count + 1
        if time - self._first >= HOME_S:
            self._home = self._sum / self._count, pose[:3, :3].copy()
            self._still_s = time

    def _follow(self, time: float, pose: Array) -> None:
        self.peak_mps = max(self.peak_mps, float(np.linalg.norm(self._v)))
        speed = float(np.linalg.norm(self._v if self._by == "position" else self._turn))
        excursion = self._excursion(pose)
        if not self._away:
            self._rest(time, speed, excursion)
            return
        self._farthest = max(self._farthest, excursion)
        self._fastest = max(self._fastest, speed)
        if excursion > NEAR * self._farthest:
            self._nearest = math.inf
            return
        self._nearest = min(self._nearest, excursion)
        slow = speed < max(SLOW_PART * self._fastest, self._slow)
        # An object that does not rest between two repetitions turns back where it is nearest.
        turns = excursion > self._nearest + self._leaves / 3
        if slow or turns:
            self.repetitions += 1
            self._usual = self._fastest
            self.last_s = time - self._left_s
            self._start_at_rest()
            self._still_s = time

    def _rest(self, time: float, speed: float, excursion: float) -> None:
        if excursion > self._leaves:
            self._away, self._left_s = True, self._still_s
            self._farthest, self._fastest = excursion, speed
        elif speed < max(SLOW_PART * self._usual, self._slow) and excursion < 0.5 * self._leaves:
            self._still_s = time

    def _start_at_rest(self) -> None:
        self._away, self._left_s, self._still_s = False, math.nan, math.nan
        self._farthest = self._fastest = 0.0
        self._nearest = math.inf

    def _excursion(self, pose: Array) -> float:
        assert self._home is not None
        if self._by == "position":
            return float(np.linalg.norm(self._x - self._home[0]))
        return _angle(pose[:3, :3], self._home[1])


def _angle(R: Array, other: Array) -> float:
    """Angle between two rotations, rad."""
    cosine = 0.5 * (float(np.sum(R * other)) - 1)
    return math.acos(min(max(cosine, -1.0), 1.0))


def _small_turn(R: Array) -> Array:
    """Axis times the sine of the angle: as a vector, so that noise at rest has no mean."""
    return 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
