# SPDX-License-Identifier: MIT
"""Sessions over days and weeks: what has changed, and whether the data show it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.intervals import Measured

__all__ = ["Change", "compare_sessions", "partner"]


@dataclass(frozen=True)
class Change:
    """The change of a measure's average from the first session to another one.

    Attributes
    ----------
    session, object, name, unit : str
    value, low, high : float
        Difference of the averages over repetitions, and its 95 % interval: of the measurement and of the variation
        between repetitions.
    shown : bool
        The interval excludes 0.
    """

    session: str
    object: str
    name: str
    unit: str
    value: float
    low: float
    high: float
    shown: bool

    def to_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)


def compare_sessions(sessions: Mapping[str, Sequence[Analysis]]) -> list[Change]:
    """Changes since the first session, for objects and measures that both have determined.

    The variance of an average is that of its measurement plus the variance between repetitions over their number
    (Student's t for few of them); the variances of the two sessions add.
    """
    names = list(sessions)
    changes = []
    for name in names[1:]:
        for k, first in enumerate(sessions[names[0]]):
            now = partner(first, k, sessions[name])
            for measure in first.averages:
                if now is not None and measure in now.averages:
                    changes += _change(name, first, now, measure)
    return changes


def partner(first: Analysis, k: int, others: Sequence[Analysis]) -> Analysis | None:
    """The same object in another session: of the same name, or the only one, or, if no name is the same, the k-th."""
    same = [a for a in others if a.trajectory.name == first.trajectory.name]
    if same:
        return same[0]
    return others[k] if k < len(others) else None


def _change(session: str, first: Analysis, now: Analysis, measure: str) -> list[Change]:
    a, b = first.averages[measure], now.averages[measure]
    half_a, half_b = _half_width(a, first), _half_width(b, now)
    if not (a.determined and b.determined and np.isfinite([a.value, b.value, half_a, half_b]).all()):
        return []
    value, half = b.value - a.value, float(np.hypot(half_a, half_b))
    name = first.trajectory.name
    return [Change(session, name, measure, a.unit, value, value - half, value + half, abs(value) > half)]


def _half_width(m: Measured, analysis: Analysis) -> float:
    """Half of the 95 % interval of an average, with the variation between repetitions; NaN for one repetition."""
    values = [r.values[m.name].value for r in analysis.repetitions if m.name in r.values]
    each = np.array([v for v in values if np.isfinite(v)])
    if len(each) < 2:
        return float("nan")
    between = float(stdtrit(len(each) - 1, 0.975)) * each.std(ddof=1) / np.sqrt(len(each))
    return float(np.hypot(0.5 * (m.high - m.low), between))
