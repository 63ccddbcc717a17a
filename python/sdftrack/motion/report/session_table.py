# SPDX-License-Identifier: MIT
"""The part of the page that compares sessions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.intervals import Measured
from sdftrack.motion.report.cells import change_text, interval_text, label_of, labels_of, table, value_html
from sdftrack.motion.report.multiples import trend_svg
from sdftrack.motion.report.sessions import Change, partner

__all__ = ["sessions_html"]

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
    changed = sum(c.shown for c in changes)
    parts = [
        f"<h2>Changes since {escape(names[0])}</h2>",
        f"<p>{_summary(changes, changed, names[0])}</p>",
        f'<p class="quiet">{EXPLAINED}</p>',
    ]
    for k, first in enumerate(sessions[names[0]]):
        if len(sessions[names[0]]) > 1:
            parts.append(f"<h3>{escape(first.trajectory.name)}</h3>")
        series = [first, *(partner(first, k, sessions[n]) for n in names[1:])]
        for at in range(1, len(names), COLUMNS):
            shown = [0, *range(at, min(at + COLUMNS, len(names)))]
            parts.append(_table(names, series, shown, found))
    return "\n".join(parts)


def _summary(changes: Sequence[Change], changed: int, first: str) -> str:
    if not changes:
        return f"No measure can be compared with {escape(first)}: it takes two repetitions or more in each session."
    return f"{changed} of {len(changes)} comparisons with {escape(first)} show a change."


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
