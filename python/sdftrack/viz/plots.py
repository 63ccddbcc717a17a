# SPDX-License-Identifier: MIT
"""Plots without a window: figure style, and saving."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from sdftrack._internal.extras import MissingExtra, need

COLORS = ("#2b6cb0", "#d1495b", "#3a9d6b", "#8456a5", "#e08e2b", "#4a4e69")
EXTRA = "plots"


def figure(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (8.0, 4.5), **options: Any
) -> tuple[Any, Any]:
    """A figure and its axes, without a display; `options` as in ``Figure.subplots``. Needs the extra [plots]."""
    need("matplotlib", EXTRA)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=size, dpi=110, layout="constrained")
    FigureCanvasAgg(fig)
    axes = fig.subplots(rows, columns, **options)
    for a in fig.axes:
        a.set_prop_cycle(color=COLORS)
        a.grid(True, alpha=0.25, linewidth=0.7)
        a.spines[["top", "right"]].set_visible(False)
    return fig, axes


def save_figure(fig: Any, path: Path) -> None:
    """Write a PNG, completely or not at all."""
    from sdftrack._internal.files import replacing

    with replacing(path) as temporary:
        fig.savefig(temporary, format="png")


def write_plots(folder: Path, plots: Mapping[str, Callable[[], Any]]) -> list[str]:
    """Plots of a command, by name and by what makes the figure; returns the names of those written.

    Without Matplotlib none is: a warning says how to install it, and plots of an earlier run are removed.
    """
    try:
        need("matplotlib", EXTRA)
    except MissingExtra as error:
        for name in plots:
            (folder / name).unlink(missing_ok=True)
        warnings.warn(f"no {', '.join(plots)}: {error}", RuntimeWarning, stacklevel=2)
        return []
    for name, make in plots.items():
        save_figure(make(), folder / name)
    return list(plots)
