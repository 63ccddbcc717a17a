# SPDX-License-Identifier: MIT
"""Pictures of the report, as SVG: the path, the speed, height and tilt."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import MissingExtra, need
from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Context, Measured
from sdftrack.motion.measures.kinematics import tilt
from sdftrack.motion.report.words import gaps_of

Array = NDArray[np.float64]


INK, QUIET, GRID, GAP = "#24323d", "#6b7780", "#d9dfe3", "#b9bfc4"
PHASES = {"move": "#cfe3f5", "hold": "#f6e7c8", "return": "#d5ebd3"}

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


FIGURES: Any = {
    "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9, "axes.edgecolor": INK, "text.color": INK,
    "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK, "axes.spines.top": False,
    "axes.spines.right": False, "axes.linewidth": 0.6, "svg.hashsalt": "sdftrack",
}  # fmt: skip
MOST_POINTS = 3000
PATH_POINTS = 8000  # of all repetitions together


def missing_plots() -> str:
    """A sentence that says how to get the plots, or "" if they can be drawn."""
    try:
        need("matplotlib", "plots")
    except MissingExtra as error:
        return str(error)
    return ""


def time_svg(a: Analysis) -> str:
    """Speed over time, and height and tilt if the direction of gravity is known; phases shaded, gaps grey."""
    duration = max(a.trajectory.duration_s, 1e-6)
    times = a.motion.times_s(min(50.0, MOST_POINTS / duration))
    mean = a.motion.mean(times)
    curves = [("speed, mm/s", 1e3 * mean.speeds_mps[0])]
    up = a.settings.get("up")
    if up is not None:
        height = 1e3 * mean.positions_m[0] @ up
        curves.append(("height, mm", height - height[np.isfinite(height)][0]))
        context = Context(times[0], times[-1], **a.settings)
        curves.append(("tilt, °", np.degrees(tilt(mean, context)[0])))
    start = times[0]
    with _figure(8.6, 0.5 + 1.3 * len(curves), len(curves), 1) as (fig, axes):
        for ax, (label, values) in zip(axes[:, 0], curves, strict=True):
            for name, color in PHASES.items():
                phases = [p for r in a.repetitions for p in r.span.phases if p.name == name]
                _shade(ax, [(p.start_s - start, p.end_s - start) for p in phases], color)
            _shade(ax, [(g - start, h - start) for g, h in gaps_of(a)], GAP)
            ax.plot(times - start, values, color=INK, lw=0.8)
            ax.set(ylabel=label, xlim=(0, duration))
            ax.label_outer()
        axes[0, 0].set_ylim(0, None)
        if len(a.repetitions) <= 40:
            for k, r in enumerate(a.repetitions, 1):
                middle = 0.5 * (r.span.start_s + r.span.end_s) - start
                axes[0, 0].text(
                    middle, 1, str(k), ha="center", va="bottom", transform=axes[0, 0].get_xaxis_transform()
                )
        axes[-1, 0].set_xlabel("time, s")
        return _svg(fig)


def _shade(ax: Any, spans: list[tuple[float, float]], color: str) -> None:
    ax.broken_barh(
        [(a, b - a) for a, b in spans], (0, 1), color=color, lw=0, transform=ax.get_xaxis_transform(), zorder=0,
    )  # fmt: skip


def path_svg(a: Analysis) -> str:
    """The path of the point from above and from the side, or as the camera sees it, a colour per repetition."""
    import matplotlib

    right, away, upward, titles = _directions(a)
    points = max(20, min(150, PATH_POINTS // max(1, len(a.repetitions))))
    origin = a.trajectory.poses[a.trajectory.usable][0, :3, 3]
    with _figure(8.6, 3.0, 1, 2) as (fig, axes):
        colors = matplotlib.colormaps["viridis"](np.linspace(0.05, 0.85, len(a.repetitions)))
        for r, color in zip(a.repetitions, colors, strict=True):
            times = np.linspace(r.span.start_s, r.span.end_s, points)
            x = 1e3 * (a.motion.mean(times).positions_m[0] - origin)
            axes[0, 0].plot(x @ right, x @ away, color=color, lw=0.9)
            axes[0, 1].plot(x @ right, x @ upward, color=color, lw=0.9)
        for ax, label, title in zip(axes[0], ("away, mm", "up, mm"), titles, strict=True):
            ax.plot(0, 0, "o", ms=4, mfc="white", mec=INK, zorder=5)
            ax.set(xlabel="right, mm", ylabel=label)
            ax.set_title(title, fontsize=9, loc="left")
            ax.set_aspect("equal", adjustable="datalim")
        return _svg(fig)


def _directions(a: Analysis) -> tuple[Array, Array, Array, tuple[str, str]]:
    """Right, away and up in the reference frame, and the names of the two views."""
    up = a.settings.get("up")
    if up is None:
        titles = "from above, if the camera looks level", "as the camera sees it"
        if a.trajectory.frame != "camera":
            titles = "x and z", "x and -y"
        return np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), np.array([0.0, -1, 0]), titles
    right = np.array([1.0, 0, 0]) - up[0] * up
    if np.linalg.norm(right) < 1e-3:  # x points up: any other direction will do
        right = np.array([0.0, 1, 0]) - up[1] * up
    right /= np.linalg.norm(right)
    return right, np.cross(up, right), up, ("from above", "from the side")


@contextlib.contextmanager
def _figure(width: float, height: float, rows: int, columns: int) -> Iterator[tuple[Any, Any]]:
    """A figure in the style of the report, and its axes (rows, columns)."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(FIGURES):
        fig = Figure(figsize=(width, height), layout="constrained")
        yield fig, fig.subplots(rows, columns, squeeze=False)


def _svg(fig: Any) -> str:
    """The figure as an element for HTML: without the XML head, coordinates to a tenth of a point."""
    out = io.StringIO()
    # Without metadata, which name documents on the network.
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    fig.savefig(out, format="svg", metadata=nothing, transparent=True)
    text = out.getvalue()
    text = text[text.index("<svg") :]
    return re.sub(r"(\d+\.\d)\d+", r"\1", text)
