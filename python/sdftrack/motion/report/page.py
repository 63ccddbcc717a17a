# SPDX-License-Identifier: MIT
"""``report.html``: one page without scripts and without a network, to read and to print."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from sdftrack import __version__
from sdftrack.motion.analysis import Analysis
from sdftrack.motion.intervals import Measured
from sdftrack.motion.report.plots import path_svg, profiles_svg, speed_svg
from sdftrack.motion.report.sessions import Change

__all__ = ["report_html"]

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 900px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin-bottom: 0; } h2 { font-size: 1.15em; margin-top: 1.8em; border-bottom: 1px solid #ddd; }
table { border-collapse: collapse; width: 100%; font-size: 13px; }
th { text-align: left; border-bottom: 1px solid #999; }
td, th { padding: 3px 10px 3px 0; vertical-align: top; } tr + tr td { border-top: 1px solid #eee; }
.number { text-align: right; white-space: nowrap; } .quiet { color: #777; } svg { max-width: 100%; height: auto; }
.lead { font-size: 1.1em; } .key span { padding: 1px 8px; margin-right: 8px; }
.wide { overflow-x: auto; } details { margin-top: 1em; }
@media print { body { margin: 0; max-width: none; font-size: 11px; } h2 { break-after: avoid; }
  svg, table { break-inside: avoid; }
  @page { size: A4; margin: 15mm; } }
"""
KEY = (
    '<p class="key"><span style="background:#cfe3f5">move</span><span style="background:#f3e3c3">hold</span>'
    '<span style="background:#d8ecd2">return</span></p>'
)
MILLI = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "rad": ("deg", 180 / np.pi), "rad/s": ("deg/s", 180 / np.pi)}
INTERVALS = (
    "Each value has a 95 % interval in brackets: the true value is in it in 95 of 100 cases. It comes from what the "
    "tracker knows of its own errors, so it tells how exactly this was measured, not how much a person varies from day "
    "to day. A measure whose interval is too wide to tell anything is printed as not determined."
)


def report_html(
    sessions: Mapping[str, Sequence[Analysis]],
    changes: Sequence[Change] = (),
    *,
    title: str = "Exercise",
    notes: Sequence[str] = (),
) -> str:
    """The report as one HTML file.

    Parameters
    ----------
    sessions : dict of str to list of Analysis
        By name; one Analysis per object.
    changes : list of Change
        Of :func:`compare_sessions`.
    title : str
    notes : list of str
        Lines below the title.
    """
    body = [f"<h1>{escape(title)}</h1>"]
    body += [f'<p class="quiet">{escape(line)}</p>' for line in notes]
    if changes:
        body.append(_changes(changes, sessions))
    for name, each in sessions.items():
        for a in each:
            heading = a.trajectory.name if len(sessions) == 1 else f"{name}: {a.trajectory.name}"
            body += _object(heading, a)
    body.append(_definitions(sessions))
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style></head>\n<body>\n'
        + "\n".join(body)
        + f'\n<p class="quiet">Made by sdftrack {escape(__version__)}. Not a medical device.</p>\n</body></html>\n'
    )


def _object(heading: str, a: Analysis) -> list[str]:
    out = [f"<h2>{escape(heading)}</h2>", f'<p class="lead">{_headline(a)}</p>', f"<p>{_trust(a)}</p>"]
    if a.repetitions:
        out += [speed_svg(a), KEY, path_svg(a), profiles_svg(a), _averages(a), _each(a)]
    return out


def _headline(a: Analysis) -> str:
    count, low, high = a.count
    range_text = "" if low == high == count else f" ({low} to {high})"
    noun = "repetition" if count == 1 else "repetitions"
    if not count:
        return f"No repetition in {a.trajectory.duration_s:.1f} s: nothing moved by 30 mm or turned by 10 degrees."
    return f"{count} {noun}{range_text} in {a.trajectory.duration_s:.1f} s."


def _trust(a: Analysis) -> str:
    shares = ", ".join(f"{100 * v:.0f} % {k.replace('_', ' ')}" for k, v in a.shares.items() if v)
    text = f"Frames: {shares}. Noise of a measured position: {1e3 * a.motion.position_noise_m:.2f} mm."
    if a.trajectory.covariances is None:
        text += " The poses came without covariances: slow errors of the sensor are not in the intervals."
    missing = [m for m in a.averages.values() if not m.determined]
    if missing:
        labels = {d.name: d.label for d in a.definitions}
        for note in dict.fromkeys(m.note for m in missing):
            names = ", ".join(_label(m.name, labels) for m in missing if m.note == note)
            text += f" Not determined: {escape(names)}; {escape(note)}."
    return text


def _averages(a: Analysis) -> str:
    labels = {d.name: d.label for d in a.definitions}
    rows = []
    for name, m in a.averages.items():
        variation = f"{100 * a.variation[name]:.0f} %" if name in a.variation and m.determined else ""
        rows.append([escape(_label(name, labels)), _value(m), _interval(m), variation])
    rows += _tremor_rows(a)
    if np.isfinite(a.path_difference_m):
        text = f"{1e3 * a.path_difference_m:.1f} mm"
        rows.append(["Difference of the paths of two repetitions (time warped)", text, "", ""])
    head = ["average over the repetitions", "value", "95 % interval", "variation"]
    return _table(head, rows)


def _tremor_rows(a: Analysis) -> list[list[str]]:
    rows = []
    for start, end, t in a.tremors:
        label = f"Tremor {t.band_hz[0]:.0f} to {t.band_hz[1]:.1f} Hz, hold at {start:.1f} to {end:.1f} s"
        floor = f"noise floor {1e3 * t.floor_m:.2f} mm"
        value = f"{1e3 * t.rms_m:.2f} mm at {t.frequency_hz:.1f} Hz" if t.determined else "not determined"
        rows.append([label, value, f"{1e3 * t.low_m:.2f} to {1e3 * t.high_m:.2f}; {floor}", ""])
    return rows


def _each(a: Analysis) -> str:
    names = [n for n in a.averages if any(n in r.values for r in a.repetitions)]
    labels = {d.name: d.label for d in a.definitions}
    head = ["repetition", "start, s", *(_label(n, labels) for n in names)]
    rows = [
        [str(k), f"{r.span.start_s:.2f}", *(_value(r.values[n]) if n in r.values else "" for n in names)]
        for k, r in enumerate(a.repetitions, 1)
    ]
    table = _table([escape(h) for h in head], rows)
    return f'<details><summary>Each repetition</summary><div class="wide">{table}</div></details>'


def _changes(changes: Sequence[Change], sessions: Mapping[str, Sequence[Analysis]]) -> str:
    labels = {d.name: d.label for each in sessions.values() for a in each for d in a.definitions}
    rows = []
    for c in changes:
        unit, factor = MILLI.get(c.unit, (c.unit, 1.0))
        verdict = ("more" if c.value > 0 else "less") if c.shown else "no change that the data show"
        interval = f"{factor * c.low:+.3g} to {factor * c.high:+.3g}"
        rows.append(
            [escape(c.session), escape(c.object), escape(_label(c.name, labels)),
             f"{factor * c.value:+.3g} {_unit(unit)}", interval, verdict]
        )  # fmt: skip
    first = escape(next(iter(sessions)))
    head = ["session", "object", "measure", "change", "95 % interval", ""]
    return f"<h2>Changes since {first}</h2>{_table(head, rows)}"


def _definitions(sessions: Mapping[str, Sequence[Analysis]]) -> str:
    asked: dict[str, Any] = {d.name: d for each in sessions.values() for a in each for d in a.definitions}
    rows = [[escape(d.label), escape(d.text), escape(d.source)] for d in asked.values()]
    table = _table(["measure", "definition", "source"], rows)
    return f"<h2>What is measured</h2><p>{INTERVALS}</p><details open><summary>Definitions</summary>{table}</details>"


def _label(name: str, labels: Mapping[str, str]) -> str:
    for suffix, text in (("_move", ", out"), ("_return", ", back")):
        if name.endswith(suffix):
            return labels.get(name.removesuffix(suffix), name) + text
    return labels.get(name, name)


def _value(m: Measured) -> str:
    if not m.determined:
        return '<span class="quiet">not determined</span>' if np.isfinite(m.value) else ""
    unit, factor = MILLI.get(m.unit, (m.unit, 1.0))
    return f"{_number(factor * m.value, factor * (m.high - m.low))} {_unit(unit)}".strip()


def _interval(m: Measured) -> str:
    if not np.isfinite(m.value):
        return ""
    _, factor = MILLI.get(m.unit, (m.unit, 1.0))
    width = factor * (m.high - m.low)
    return f"{_number(factor * m.low, width)} to {_number(factor * m.high, width)}"


def _number(value: float, width: float) -> str:
    """As many digits as the interval allows: its second digit."""
    digits = (
        int(np.clip(1 - np.floor(np.log10(width)), 0, 4))
        if width > 0
        else 0
        if float(value).is_integer()
        else 2
    )
    return f"{value:.{digits}f}"


def _unit(unit: str) -> str:
    return "" if unit == "1" else escape(unit.replace("^2", "²"))


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = "".join(f"<th>{h}</th>" for h in head)
    lines = "".join("<tr>" + "".join(f"<td>{c}</td>" for c in row) + "</tr>\n" for row in rows)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>\n{lines}</tbody></table>"
