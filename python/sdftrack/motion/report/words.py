# SPDX-License-Identifier: MIT
"""The sentences of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from html import escape

import numpy as np

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Measured
from sdftrack.motion.trajectory import Trajectory

YEAR_2000_S, YEAR_2100_S = 946_684_800.0, 4_102_444_800.0
STATUS = {
    "ok": "tracked",
    "weak": "tracked with less certainty",
    "lost": "lost",
    "bad_frame": "without an image",
}
NO_UP = "the direction of gravity is not known; give --up x,y,z, or --up table"
NO_CUES = "no signals to start were given; give --cues"
INTERVALS = (
    "The range behind a value is its 95 % interval: of a hundred such intervals about ninety-five contain the true "
    "value of the recorded movement. It comes from the errors of the measured poses. It says how exactly this movement "
    "was measured, not how much a person varies from one day to the next. How much the repetitions differ from each "
    "other is the column “varies by”: their standard deviation, in percent of the mean. A measure whose "
    "interval is too wide to be of use is printed as “not determined”, with what would help. A dash means that "
    "the measure has no meaning there, for example a reaction time without a signal."
)


def date_of(trajectory: Trajectory) -> str:
    """The date of the recording in UTC, if its times count from 1970 as those of most cameras do; else ""."""
    start = float(trajectory.times_s[0])
    if not YEAR_2000_S < start < YEAR_2100_S:
        return ""
    return datetime.fromtimestamp(start, UTC).strftime("%Y-%m-%d %H:%M UTC")


def headline(a: Analysis) -> str:
    """How many repetitions in how much time, in a sentence."""
    count, low, high = a.count
    duration = f"{a.trajectory.duration_s:.1f} s"
    if not count:
        return f"No repetition in {duration}: nothing moved by 30 mm or turned by 10°."
    noun = "repetition" if count == 1 else "repetitions"
    between = "" if low == high == count else f" (95 % interval: {low} to {high})"
    return f"{count} {noun}{between} in {duration}."


def gaps_of(a: Analysis) -> list[tuple[float, float]]:
    """Stretches of the recording about which nothing is said, s."""
    first, last = float(a.trajectory.times_s[0]), float(a.trajectory.times_s[-1])
    edges = [first, *(t for p in a.motion.pieces for t in (p.start_s, p.end_s)), last]
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return [(start, end) for start, end in pairs if end - start > 1e-6]


def open_questions(a: Analysis) -> list[str]:
    """What was not determined, or has no meaning here, and what would help: a line of HTML for each reason."""
    labels = labels_of([a])
    reasons: dict[str, list[str]] = {}
    for m in a.averages.values():
        if not m.determined:
            reasons.setdefault(m.note, []).append(label_of(m.name, labels))
    lines = [f"<b>Not determined:</b> {', '.join(names)} – {escape(why)}." for why, names in reasons.items()]
    if not a.repetitions:
        return lines
    defined = {d.name for d in a.definitions for m in a.averages if m.startswith(d.name)}
    missing = [d for d in a.definitions if d.name not in defined]
    if a.settings.get("up") is None and (
        names := [d.label for d in missing if "gravity" in d.text or "vertical" in d.text]
    ):
        lines.append(f"<b>Not measured:</b> {escape(', '.join(names))} – {NO_UP}.")
    if all(r.cue_s is None for r in a.repetitions) and any(d.name == "reaction_time" for d in missing):
        lines.append(f"<b>Not measured:</b> Reaction time – {NO_CUES}.")
    return lines


def trust(a: Analysis) -> str:
    """Shares of the statuses, gaps and noise, in a sentence each."""
    shares = ", ".join(f"{100 * share:.3g} % {STATUS[name]}" for name, share in a.shares.items() if share)
    lines = [f"Of {len(a.trajectory)} images: {shares}."]
    if gaps := gaps_of(a):
        total = sum(end - start for start, end in gaps)
        noun = "gap" if len(gaps) == 1 else "gaps"
        lines.append(f"{len(gaps)} {noun} without poses, {total:.1f} s in all; nothing is said about them.")
    lines.append(f"Noise of a measured position: {1e3 * a.motion.position_noise_m:.2f} mm.")
    if a.trajectory.covariances is None:
        lines.append(
            "The poses came without covariances: slow errors of the sensor are not in the intervals."
        )
    return " ".join(lines)


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
