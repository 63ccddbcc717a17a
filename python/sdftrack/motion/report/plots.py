# SPDX-License-Identifier: MIT
"""Pictures of the report, as SVG."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.analysis import Analysis

__all__ = ["path_svg", "profiles_svg", "speed_svg"]

Array = NDArray[np.float64]
INK, GRID = "#333333", "#dddddd"
PHASES = {"move": "#cfe3f5", "hold": "#f3e3c3", "return": "#d8ecd2"}
STYLE: Any = {
    "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9, "axes.edgecolor": INK, "text.color": INK,
    "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK, "axes.spines.top": False,
    "axes.spines.right": False, "axes.linewidth": 0.6, "svg.hashsalt": "sdftrack",
}  # fmt: skip
MOST_POINTS = 3000


def speed_svg(a: Analysis) -> str:
    """Speed over time with phases shaded; gaps are left out."""
    rate = min(50.0, MOST_POINTS / max(a.trajectory.duration_s, 1e-6))
    times = a.motion.times_s(rate)
    mean = a.motion.mean(times)
    start = times[0]
    with _figure(7.4, 1.9) as (fig, axes):
        ax = axes[0]
        for r in a.repetitions:
            for phase in r.span.phases:
                ax.axvspan(
                    phase.start_s - start, phase.end_s - start, color=PHASES.get(phase.name, "#eeeeee"), lw=0
                )
        ax.plot(times - start, 1e3 * mean.speeds_mps[0], color=INK, lw=0.8)
        if not mean.observed.all():
            ax.plot(
                times[~mean.observed] - start, np.zeros((~mean.observed).sum()), ".", color="#c44536", ms=2
            )
        ax.set(xlabel="time, s", ylabel="speed, mm/s", xlim=(0, times[-1] - start), ylim=(0, None))
        return _svg(fig)


def path_svg(a: Analysis) -> str:
    """The path of the point in the reference frame, from the front and from above, a colour per repetition."""
    with _figure(7.4, 2.9, 2) as (fig, axes):
        colors = _colors(len(a.repetitions))
        for r, color in zip(a.repetitions, colors, strict=True):
            times = np.linspace(r.span.start_s, r.span.end_s, 150)
            x = 1e3 * a.motion.mean(times).positions_m[0]
            axes[0].plot(x[:, 0], x[:, 1], color=color, lw=0.9)
            axes[1].plot(x[:, 0], x[:, 2], color=color, lw=0.9)
        camera = a.trajectory.frame == "camera"
        for ax, label, title in (
            (axes[0], "y, mm", "as the camera sees it" if camera else "x and y"),
            (axes[1], "z, mm", "from above: z is the distance from the camera" if camera else "x and z"),
        ):
            ax.set(xlabel="x, mm", ylabel=label)
            ax.set_title(title, fontsize=9, loc="left")
            ax.set_aspect("equal", adjustable="datalim")
        if camera:
            axes[0].invert_yaxis()
        return _svg(fig)


def profiles_svg(a: Analysis) -> str:
    """Speed profiles of all repetitions over each other, from their start."""
    with _figure(7.4, 1.9) as (fig, axes):
        for r, color in zip(a.repetitions, _colors(len(a.repetitions)), strict=True):
            times = np.linspace(r.span.start_s, r.span.end_s, 200)
            axes[0].plot(times - times[0], 1e3 * a.motion.mean(times).speeds_mps[0], color=color, lw=0.8)
        axes[0].set(xlabel="time since the start of the repetition, s", ylabel="speed, mm/s", ylim=(0, None))
        return _svg(fig)


def _colors(count: int) -> list[Any]:
    import matplotlib

    return [matplotlib.colormaps["viridis"](v) for v in np.linspace(0.05, 0.85, count)]


class _figure:
    """A figure in the style of the report, closed at the end."""

    def __init__(self, width: float, height: float, columns: int = 1) -> None:
        self._size, self._columns = (width, height), columns

    def __enter__(self) -> tuple[Any, Any]:
        import matplotlib
        from matplotlib.figure import Figure

        self._style = matplotlib.rc_context(STYLE)
        self._style.__enter__()
        fig = Figure(figsize=self._size, layout="constrained")
        return fig, fig.subplots(1, self._columns, squeeze=False)[0]

    def __exit__(self, *about: object) -> None:
        self._style.__exit__(None, None, None)


def _svg(fig: Any) -> str:
    """The figure as an element for HTML: without the XML head, coordinates to a tenth of a point."""
    out = io.StringIO()
    # Without metadata, which name documents on the network.
    fig.savefig(out, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    text = out.getvalue()
    text = text[text.index("<svg") :]
    return re.sub(r"(\d+\.\d)\d+", r"\1", text)
