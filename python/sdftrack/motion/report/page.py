# SPDX-License-Identifier: MIT
"""``report.html``: one page without scripts and without a network, to read and to print."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.report.plots import (
    GAP,
    PHASES,
    missing_plots,
    path_svg,
    repetitions_svg,
    time_svg,
)
from sdftrack.motion.report.sessions import Change, sessions_html
from sdftrack.motion.report.words import (
    INTERVALS,
    date_of,
    gaps_of,
    headline,
    interval_text,
    label_of,
    labels_of,
    open_questions,
    trust,
    value_html,
)
from sdftrack.motion.two_objects import Pair
from sdftrack.viz.page import html_page, table

TILES = ("repetition_time", "reach", "peak_speed_move", "sparc_move", "max_tilt")  # what is asked for first
ROWS = 5  # measures side by side in the table of repetitions, for A4


def report_html(
    sessions: Mapping[str, Sequence[Analysis]],
    changes: Sequence[Change] = (),
    *,
    title: str = "Exercise",
    notes: Sequence[str] = (),
    pairs: Mapping[str, Sequence[Pair]] | None = None,
) -> str:
    """The report as one HTML file; `sessions`, `changes` and `pairs` as of :func:`measures_json`.

    `notes` are lines below the title.
    """
    without = missing_plots()
    if without:
        warnings.warn(f"report: no plots of path and time: {without}", RuntimeWarning, stacklevel=2)
    body = [f"<header><h1>{escape(title)}</h1>"]
    body += [f'<p class="quiet">{escape(line)}</p>' for line in notes]
    if without:
        body.append(f'<p class="quiet">Without plots of path and time: {escape(without)}.</p>')
    body.append("</header>")
    if len(sessions) > 1:
        body.append(sessions_html(sessions, changes))
    for name, each in sessions.items():
        for a in each:
            heading = a.trajectory.name if len(sessions) == 1 else f"{name}: {a.trajectory.name}"
            body.append(_object(heading, a, not without))
        body += [_pair(p) for p in (pairs or {}).get(name, ())]
    body.append(_definitions(sessions))
    return html_page(title, "\n".join(body), " Not a medical device.")


def _object(heading: str, a: Analysis, plots: bool) -> str:
    date = date_of(a.trajectory)
    out = [f'<section class="session"><h2>{escape(heading)}</h2>']
    out.append(f"<p>{f'{date}. ' if date else ''}{headline(a)}</p>")
    if a.repetitions:
        out.append(_tiles(a))
    out += [f'<p class="note">{line}</p>' for line in open_questions(a)]
    if a.repetitions and plots:
        out += ["<h3>Path</h3>", path_svg(a), '<p class="quiet">A colour for each repetition, from dark (first) to '
                "light (last). The ring: the first measured position.</p>"]  # fmt: skip
    if plots:
        out += ["<h3>Over time</h3>", time_svg(a), _key(a)]
    if a.repetitions:
        out += ["<h3>Speed of each repetition</h3>", repetitions_svg(a), _averages(a), _each(a)]
    out.append(f'<p class="quiet">{trust(a)}</p></section>')
    return "\n".join(out)


def _tiles(a: Analysis) -> str:
    labels = labels_of([a])
    count, low, high = a.count
    cells = [f'<div class="tile"><b>{count}</b><span>repetitions</span><span>{low} to {high}</span></div>']
    for m in (a.averages[n] for n in TILES if n in a.averages):
        below = interval_text(m) if m.determined else ""
        cells.append(
            f'<div class="tile"><b>{value_html(m)}</b><span>{label_of(m.name, labels)}</span><span>{below}</span></div>'
        )
    return f'<div class="tiles">{"".join(cells)}</div>'


def _key(a: Analysis) -> str:
    used = {p.name for r in a.repetitions for p in r.span.phases}
    names = [(name, color) for name, color in PHASES.items() if name in used]
    names += [("no poses", GAP)] if gaps_of(a) else []
    spans = "".join(f'<span style="background:{color}">{name}</span>' for name, color in names)
    return f'<p class="key">{spans}</p>' if spans else ""


def _averages(a: Analysis) -> str:
    labels = labels_of([a])
    texts = {d.name: d.text for d in a.definitions}
    rows = []
    for name, m in a.averages.items():
        varies = f"{100 * a.variation[name]:.0f} %" if name in a.variation and m.determined else ""
        text = texts.get(name) or texts.get(name.rsplit("_", 1)[0], "")
        cell = interval_text(m) if m.determined else f'<span class="quiet">{escape(m.note)}</span>'
        rows.append(
            [f'<span title="{escape(text)}">{label_of(name, labels)}</span>', value_html(m), cell, varies]
        )
    difference = a.path_difference_m
    if np.isfinite(difference):
        rows.append(
            [
                "Mean distance between the paths of two repetitions (time warped)",
                f"{1e3 * difference:.1f} mm",
                "",
                "",
            ]
        )
    head = ["average over the repetitions", "value", "95 % interval", "varies by"]
    return f"<h3>Averages</h3>{table(head, rows)}{_tremor(a)}"


def _tremor(a: Analysis) -> str:
    rows = []
    for start, end, t in a.tremors:
        seen = f"{1e3 * t.rms_m:.2f} mm at {t.frequency_hz:.1f} Hz" if t.determined else (
            '<span class="open">not determined</span>')  # fmt: skip
        rows.append(
            [f"Hold from {start:.1f} to {end:.1f} s", seen, f"{1e3 * t.low_m:.2f} to {1e3 * t.high_m:.2f}",
             f"{1e3 * t.floor_m:.2f} mm", f"{t.band_hz[0]:.0f} to {t.band_hz[1]:.1f} Hz"]
        )  # fmt: skip
    head = ["tremor", "root mean square", "95 % interval", "noise alone", "band"]
    return f"<h3>Tremor in holds</h3>{table(head, rows)}" if rows else ""


def _each(a: Analysis) -> str:
    """Tables of a few measures side by side, with intervals; collapsed on a screen if they are long."""
    labels = labels_of([a])
    names = list(a.averages)
    parts = []
    for at in range(0, len(names), ROWS):
        some = names[at : at + ROWS]
        rows = []
        for k, r in enumerate(a.repetitions, 1):
            cells = []
            for m in (r.values.get(n) for n in some):
                interval = f'<br><span class="quiet">{interval_text(m)}</span>' if m and m.determined else ""
                cells.append("–" if m is None else value_html(m) + interval)
            gap = f", {r.gap_s:.1f} s unseen" if r.gap_s else ""
            rows.append([f"{k}: {r.span.start_s:.2f} s{gap}", *cells])
        parts.append(table(["repetition: start", *(label_of(n, labels) for n in some)], rows, "each"))
    return (
        f'<details><summary>Each repetition</summary><div class="wide">{"<br>".join(parts)}</div></details>'
    )


def _pair(pair: Pair) -> str:
    rows = [
        [escape(d.label), value_html(m), interval_text(m) if m.determined else escape(m.note), escape(d.text)]
        for d, m in pair.values
    ]
    names = " and ".join(escape(n) for n in pair.names)
    return (
        f"<h2>{names} together</h2><p>{escape(pair.note)}</p>"
        f"{table(['average over the repetitions', 'value', '95 % interval', 'definition'], rows)}"
    )


def _definitions(sessions: Mapping[str, Sequence[Analysis]]) -> str:
    asked = {d.name: d for each in sessions.values() for a in each for d in a.definitions}
    rows = [[escape(d.label), escape(d.text), escape(d.source)] for d in asked.values()]
    return (
        f'<section class="page"><h2>What the numbers mean</h2><p>{INTERVALS}</p>'
        f"<details open><summary>Definitions and sources</summary>{table(['measure', 'definition', 'source'], rows)}"
        "</details></section>"
    )
