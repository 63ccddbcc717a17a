# SPDX-License-Identifier: MIT
"""Plots without a window: figure style, and saving."""

from __future__ import annotations

from pathlib import Path
from typing import Any

__all__ = ["figure", "save_figure"]

COLORS = ("#2b6cb0", "#d1495b", "#3a9d6b", "#8456a5", "#e08e2b", "#4a4e69")


def figure(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (8.0, 4.5), **options: Any
) -> tuple[Any, Any]:
    """A figure and its axes, without a display; `options` as in ``Figure.subplots``."""
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
