# SPDX-License-Identifier: MIT
"""Figure 6.3: silhouettes from their first 3 to 27 harmonics.

Set-up: each frame of the sets of Figure 6.9 is cut to its first harmonics and its zero level drawn. Printed: pictures
only; large gains from 3 to 15 harmonics, small ones from 15 to 27; 10 to 15 are used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.measures.shape_protocol import SIZE
from experiments.thesis.silhouettes import sets
from sdftrack.contour.dct import harmonics, silhouette
from sdftrack.evaluation.tables import text_table
from sdftrack.metrics import iou

__all__ = ["run"]

Mask: TypeAlias = NDArray[np.bool_]
NUMBERS = (3, 6, 9, 12, 15, 18, 21, 24, 27)
ENOUGH = 15  # harmonics, from which on little is gained, as printed
EVERY = 10  # frames


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    used, note = sets(context)
    overlap = {}
    for i, (name, masks) in enumerate(used.items()):
        context.step(i, len(used), name)
        overlap[name] = [float(np.mean([iou(_cut(m, n), m) for m in masks[::EVERY]])) for n in NUMBERS]
    mean = np.mean(list(overlap.values()), axis=0)
    at = NUMBERS.index(ENOUGH)
    gains = {"3 to 15": float(mean[at] - mean[0]), "15 to 27": float(mean[-1] - mean[at])}
    head = ["set", *(str(n) for n in NUMBERS)]
    rows = [[name, *(f"{x:.3f}" for x in values)] for name, values in overlap.items()]
    rows.append(["mean", *(f"{x:.3f}" for x in mean)])
    rows.append(["printed", "pictures only", *("" for _ in NUMBERS[1:])])
    title = f"Figure 6.3, overlap of silhouettes cut to their first harmonics; {note}"
    write_text(context.out / "table.txt", text_table(title, head, rows) + "\n")
    _plot(context.out / "figure.png", {name: masks[len(masks) // 3] for name, masks in used.items()})
    notes = [
        f"gain from 3 to 15 harmonics {gains['3 to 15']:.3f}, from 15 to 27 {gains['15 to 27']:.3f}; printed: large, "
        "then small"
    ]
    return {"title": title, "head": head, "rows": rows, "overlap": overlap, "gains": gains, "notes": notes}


def _cut(mask: Mask, n: int) -> Mask:
    return np.asarray(silhouette(harmonics(mask, n), SIZE))


def _plot(path: Path, shown: dict[str, Mask]) -> None:
    from sdftrack.viz.plots import figure, save_figure

    columns = len(NUMBERS) + 1
    fig, axes = figure(len(shown), columns, size=(1.15 * columns, 1.25 * len(shown)), squeeze=False)
    for row, (name, mask) in zip(axes, shown.items(), strict=True):
        for ax, n in zip(row, (None, *NUMBERS), strict=True):
            ax.imshow(mask if n is None else _cut(mask, n), cmap="gray")
            ax.set_xticks([])
            ax.set_yticks([])
            ax.set_title(
                "" if name != next(iter(shown)) else "silhouette" if n is None else str(n), fontsize=8
            )
        row[0].set_ylabel(name, fontsize=8)
    save_figure(fig, path)
