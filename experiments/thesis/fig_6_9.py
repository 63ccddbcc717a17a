# SPDX-License-Identifier: MIT
"""Figure 6.9: overlap of recovered silhouettes, for every split of ten harmonics into inputs and outputs.

Set-up: a random rectangle hides 10 to 80 % of each frame; each split is recovered whatever the judgement. Printed:
harmonic 10 alone already works; 8-10 -> 1-7 or 9-10 -> 1-8 are best in all four sets; more inputs get worse.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from experiments.thesis import Context
from experiments.thesis.measures.shape_protocol import SHARES, cases
from experiments.thesis.silhouettes import SPLITS, ask_all, by_share, sets, split_name
from sdftrack.evaluation.tables import text_table
from sdftrack.metrics import iou

__all__ = ["run"]

SEED = 0
BEST_PRINTED = (2, 3)  # inputs
ALIKE = 0.005  # overlaps that differ by less are called equal


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    used, note = sets(context)
    levels = []
    for i, (name, masks) in enumerate(used.items()):
        context.step(i, len(used), name)
        what = cases(masks, SHARES, "rectangle", SEED)
        curves = {}
        for way, (_, answers) in ask_all(masks, what).items():
            curves[way] = by_share(answers, lambda a: a.completed)[1].tolist()
        seen = [[iou(c.seen, c.whole) for c in what if c.share == s] for s in SHARES]
        curves["no recovery"] = [float(np.mean(x)) for x in seen]
        levels.append({"set": name, "frames": len(masks), "curves": curves, **_best(curves)})
    head = ["way", *(row["set"] for row in levels)]
    ways = [*(split_name(n) for n in SPLITS), "memory", "no recovery"]
    cells = [[w, *(f"{np.mean(row['curves'][w]):.3f}" for row in levels)] for w in ways]
    cells.append(["best split", *(row["best"] for row in levels)])
    cells.append(["printed best", *("8-10 or 9-10" for _ in levels)])
    title = f"Figure 6.9, mean overlap over seven sizes of rectangles, 10 to 80 % hidden; {note}"
    write_text(context.out / "table.txt", text_table(title, head, cells) + "\n")
    _plot(context.out / "figure.png", levels)
    as_printed = [row["set"] for row in levels if row["as_printed"]]
    notes = [f"8-10 or 9-10 within {ALIKE} of the best split in: {', '.join(as_printed) or 'none'}"]
    return {"title": title, "head": head, "rows": cells, "levels": levels, "notes": notes}


def _best(curves: dict[str, list[float]]) -> dict[str, Any]:
    mean = {n: float(np.mean(curves[split_name(n)])) for n in SPLITS}
    top = max(mean, key=lambda n: mean[n])
    return {
        "best": split_name(top),
        "as_printed": bool(max(mean[n] for n in BEST_PRINTED) >= mean[top] - ALIKE),
    }


def _plot(path: Path, levels: list[dict[str, Any]]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    columns = (len(levels) + 1) // 2
    fig, axes = figure(2, columns, size=(4.4 * columns, 7.2), sharex=True, sharey=True, squeeze=False)
    for row, ax in zip(levels, axes.ravel(), strict=False):
        for i, n in enumerate(SPLITS):
            late = i >= len(COLORS)
            ax.plot(
                SHARES, row["curves"][split_name(n)], "--" if late else "-", color=COLORS[i % len(COLORS)],
                linewidth=1.2, label=split_name(n),
            )  # fmt: skip
        ax.plot(SHARES, row["curves"]["memory"], color="black", linewidth=2, label="memory (default)")
        ax.plot(SHARES, row["curves"]["no recovery"], ":", color="0.5", label="no recovery")
        ax.set_title(f"{row['set']}, {row['frames']} frames", fontsize=9)
    for ax in axes[-1]:
        ax.set_xlabel("share hidden")
    for ax in axes[:, 0]:
        ax.set_ylabel("overlap with the truth")
    axes[0, 0].legend(fontsize=7, ncols=2)
    save_figure(fig, path)
