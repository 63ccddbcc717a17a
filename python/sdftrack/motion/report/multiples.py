# SPDX-License-Identifier: MIT
"""Small pictures that are drawn line by line: speed of each repetition, and a measure over the sessions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.intervals import Measured
from sdftrack.motion.report.style import GRID, INK, PHASES, QUIET

__all__ = ["repetitions_svg", "trend_svg"]

Array = NDArray[np.float64]
WIDTH, MARGIN = 880.0, 22.0
POINTS = 70


def repetitions_svg(a: Analysis) -> str:
    """The speed of each repetition in a panel of its own, all with the same scales."""
    columns = 5 if len(a.repetitions) <= 40 else 10
    width, height = WIDTH / columns, 78.0 if columns == 5 else 44.0
    times = [np.linspace(r.span.start_s, r.span.end_s, POINTS) for r in a.repetitions]
    speeds = [1e3 * a.motion.mean(t).speeds_mps[0] for t in times]
    longest = max(float(t[-1] - t[0]) for t in times)
    fastest = max(float(np.nanmax(v, initial=0.0)) for v in speeds) or 1.0
    sx, sy = (width - 14) / longest, (height - MARGIN) / fastest
    rows = -(-len(times) // columns)
    parts = []
    for k, (r, t, v) in enumerate(zip(a.repetitions, times, speeds, strict=True)):
        x0, y0 = (k % columns) * width + 2, (k // columns + 1) * height - 6
        for p in r.span.phases:
            color = PHASES.get(p.name, "#eee")
            parts.append(
                f'<rect x="{x0 + sx * (p.start_s - t[0]):.1f}" y="{y0 - height + MARGIN:.1f}" '
                f'width="{sx * (p.end_s - p.start_s):.1f}" height="{height - MARGIN:.1f}" fill="{color}"/>'
            )
        parts.append(f'<path d="M{x0:.1f} {y0:.1f}h{width - 14:.1f}" stroke="{GRID}"/>')
        parts.append(f'<path d="{_line(x0 + sx * (t - t[0]), y0 - sy * v)}" fill="none" stroke="{INK}"/>')
        parts.append(f'<text x="{x0:.1f}" y="{y0 - height + MARGIN - 3:.1f}">{k + 1}</text>')
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {rows * height:.0f}" role="img" aria-label="speed of each repetition" '
        f'font-size="11" font-family="sans-serif" fill="{QUIET}">{"".join(parts)}</svg>'
        f'<p class="quiet">All panels: 0 to {longest:.1f} s from left to right, 0 to {fastest:.0f} mm/s upwards.</p>'
    )


def _line(x: Array, y: Array) -> str:
    """A path that is broken where y is not known."""
    out, down = [], False
    for a, b in zip(x, y, strict=True):
        if np.isfinite(b):
            out.append(f"{'L' if down else 'M'}{a:.1f} {b:.1f}")
        down = bool(np.isfinite(b))
    return "".join(out)


def trend_svg(values: Sequence[Measured | None]) -> str:
    """Values with their intervals over the sessions; not determined ones as a hollow point."""
    known = [m for m in values if m is not None and np.isfinite([m.value, m.low, m.high]).all()]
    if not known:
        return ""
    low, high = min(min(m.low, m.value) for m in known), max(max(m.high, m.value) for m in known)
    span = high - low or 1.0
    step, tall = 22, 34
    parts = []
    for k, m in enumerate(values):
        if m is None or m not in known:
            continue
        x = 8 + step * k
        top, bottom, y = (4 + (tall - 8) * (high - v) / span for v in (m.high, m.low, m.value))
        parts.append(f'<path d="M{x} {top:.1f}V{bottom:.1f}" stroke="{QUIET}" stroke-width="2"/>')
        fill = INK if m.determined else "white"
        parts.append(f'<circle cx="{x}" cy="{y:.1f}" r="3" fill="{fill}" stroke="{INK}"/>')
    width = 16 + step * (len(values) - 1)
    return f'<svg width="{width}" height="{tall}" viewBox="0 0 {width} {tall}">{"".join(parts)}</svg>'
