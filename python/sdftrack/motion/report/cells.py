# SPDX-License-Identifier: MIT
"""Numbers, labels and tables of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.intervals import Measured

__all__ = [
    "MILLI",
    "change_text",
    "interval_text",
    "label_of",
    "labels_of",
    "table",
    "unit_html",
    "value_html",
]

MILLI = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "rad": ("°", 180 / np.pi), "rad/s": ("°/s", 180 / np.pi)}
SUFFIXES = {"_move": ", out", "_return": ", back"}


def labels_of(analyses: Sequence[Analysis]) -> dict[str, str]:
    """The labels of all measures by name, those of movements with "out" and "back"."""
    labels = {}
    for d in (d for a in analyses for d in a.definitions):
        labels[d.name] = d.label
        labels.update({d.name + suffix: d.label + text for suffix, text in SUFFIXES.items()})
    return labels


def label_of(name: str, labels: Mapping[str, str]) -> str:
    """Escaped, for HTML."""
    return escape(labels.get(name, name))


def value_html(m: Measured) -> str:
    """Value and unit; "not determined", or a dash where undefined."""
    if not np.isfinite(m.value):
        return "–"
    if not m.determined:
        return '<span class="open">not determined</span>'
    unit, factor = MILLI.get(m.unit, (m.unit, 1.0))
    return f"{_number(factor * m.value, factor * (m.high - m.low))}&nbsp;{unit_html(unit)}".removesuffix(
        "&nbsp;"
    )


def interval_text(m: Measured) -> str:
    """Low to high, without the unit, with the digits of the value."""
    if not np.isfinite(m.value):
        return ""
    _, factor = MILLI.get(m.unit, (m.unit, 1.0))
    width = factor * (m.high - m.low)
    return f"{_number(factor * m.low, width)} to {_number(factor * m.high, width)}"


def change_text(value: float, low: float, high: float, unit: str) -> str:
    """A difference with its sign and its interval."""
    unit, factor = MILLI.get(unit, (unit, 1.0))
    value, low, high = (factor * v for v in (value, low, high))
    digits = _digits(high - low)
    told = [f"{round(v, digits) + 0.0:+.{digits}f}" for v in (value, low, high)]
    return f"{f'{told[0]}&nbsp;{unit_html(unit)}'.removesuffix('&nbsp;')} ({told[1]} to {told[2]})"


def _number(value: float, width: float) -> str:
    """As many digits as the interval allows: to the first digit of its half width."""
    if width == 0 and float(value).is_integer():
        return f"{value:.0f}"
    digits = _digits(width)
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _digits(width: float) -> int:
    return int(np.clip(-np.floor(np.log10(0.5 * width)), 0, 4)) if width > 0 else 2


def unit_html(unit: str) -> str:
    return "" if unit == "1" else escape(unit.replace("^2", "²"))


def table(head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    """A table of HTML cells; the first column is a heading of its row."""
    cells = "".join(f'<th scope="col">{h}</th>' for h in head)
    lines = "".join(
        f'<tr><th scope="row">{row[0]}</th>' + "".join(f"<td>{c}</td>" for c in row[1:]) + "</tr>\n"
        for row in rows
    )
    return f'<table class="{kind}"><thead><tr>{cells}</tr></thead><tbody>\n{lines}</tbody></table>'
