# SPDX-License-Identifier: MIT
"""Sessions over days and weeks: what has changed, and whether the data show it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from scipy.special import stdtrit

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Measured
from sdftrack.motion.report.plots import trend_svg
from sdftrack.motion.report.words import change_text, interval_text, label_of, labels_of, value_html
from sdftrack.viz.page import table


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


COLUMNS = 4  # sessions beside the first one in a table: more are too narrow for A4
EXPLAINED = (
    "Averages over the repetitions of each session, with 95 % intervals in brackets. Below a value: the change since "
    "the first session, whose interval also contains how much the repetitions of both sessions vary. “Changed” is "
    "printed only where the interval of the change excludes 0."
)


def sessions_html(sessions: Mapping[str, Sequence[Analysis]], changes: Sequence[Change]) -> str:
    """Each measure over the sessions, a table per object."""
    names = list(sessions)
    found = {(c.session, c.object, c.name): c for c in changes}
    changed, start = sum(c.shown for c in changes), escape(names[0])
    summary = f"{changed} of {len(changes)} comparisons with {start} show a change."
    if not changes:
        summary = (
            f"No measure can be compared with {start}: it takes two repetitions or more in each session."
        )
    parts = [f"<h2>Changes since {start}</h2>", f"<p>{summary}</p>", f'<p class="quiet">{EXPLAINED}</p>']
    for k, first in enumerate(sessions[names[0]]):
        if len(sessions[names[0]]) > 1:
            parts.append(f"<h3>{escape(first.trajectory.name)}</h3>")
        series = [first, *(partner(first, k, sessions[n]) for n in names[1:])]
        for at in range(1, len(names), COLUMNS):
            shown = [0, *range(at, min(at + COLUMNS, len(names)))]
            parts.append(_table(names, series, shown, found))
    return "\n".join(parts)


def _table(
    names: list[str],
    series: list[Analysis | None],
    shown: list[int],
    found: Mapping[tuple[str, str, str], Change],
) -> str:
    there = [a for a in series if a is not None]
    labels = labels_of(there)
    first = there[0]
    rows = []
    for name in dict.fromkeys(n for a in there for n in a.averages):
        values = [None if a is None else a.averages.get(name) for a in series]
        cells = [_cell(values[i], found.get((names[i], first.trajectory.name, name))) for i in shown]
        rows.append([label_of(name, labels), *cells, trend_svg([values[i] for i in shown])])
    return table(["measure", *(escape(names[i]) for i in shown), ""], rows)


def _cell(m: Measured | None, change: Change | None) -> str:
    if m is None or not np.isfinite(m.value):
        return "–"
    text = value_html(m)
    if m.determined:
        text += f' <span class="quiet">({interval_text(m)})</span>'
    if change is not None:
        told = change_text(change.value, change.low, change.high, change.unit)
        verdict = '<span class="changed">changed</span>' if change.shown else "no change that the data show"
        text += f"<br>{told}, {verdict}"
    return text
