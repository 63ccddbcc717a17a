# SPDX-License-Identifier: MIT
"""Figure 6.10: hidden silhouettes detected, precision against recall, for every split of ten harmonics.

Set-up: the frames of Figure 6.9 with 10 to 80 % hidden, and the whole ones. The threshold t in |x_pred - x_obs|^2 >=
2 t^2 varies from 0.01 to 100 times the error e of training; "novel" counts as not occluded; mean over the sets.
Printed: 9-10 -> 1-8 is best; t = e lies near the best point; more inputs get worse.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.measures.shape_protocol import SHARES, Answer, cases, detection
from experiments.thesis.silhouettes import ask_all, sets, split_name
from sdftrack.evaluation.tables import text_table

__all__ = ["run"]

SEED = 0
FACTORS = np.geomspace(0.01, 100, 161)  # t / e
NEAR_BEST = 0.03  # F1 at t = e below the curve's best, at most: "near"
BEST_PRINTED = split_name(2)
HEAD = ["way", "average precision", "F1 at t = e", "best F1", "near", "called novel"]
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    used, note = sets(context)
    found: dict[str, list[Any]] = {}
    for i, (name, masks) in enumerate(used.items()):
        context.step(i, len(used), name)
        what = cases(masks, (0.0, *SHARES), "rectangle", SEED)
        for way, (memory, answers) in ask_all(masks, what).items():
            found.setdefault(way, []).append((answers, memory.threshold))
    levels = [_level(way, per_set) for way, per_set in found.items()]
    cells = [_cells(row) for row in levels]
    splits = [row for row in levels if row["way"] != "memory"]
    best = max(splits, key=lambda row: row["average_precision"])["way"]
    title = f"Figure 6.10, mean over {len(used)} sets: {note}"
    write_text(context.out / "table.txt", text_table(title, HEAD, cells) + "\n")
    _plot(context.out / "figure.png", levels)
    notes = [
        f"best split: {best}; printed: {BEST_PRINTED} best, t = e near the best point, more inputs worse"
    ]
    return {"title": title, "head": HEAD, "rows": cells, "levels": levels, "notes": notes}


def precision_recall(answers: list[Answer], threshold: float) -> tuple[Array, Array]:
    """Precision and recall of "occluded" at FACTORS times the threshold; precision 1 where nothing is called so."""
    score = np.array([-1.0 if a.judgement == "novel" else a.error for a in answers])
    hidden = np.array([a.share > 0 for a in answers])
    called = score[None, :] >= FACTORS[:, None] * threshold
    right = (called & hidden).sum(axis=1)
    count = called.sum(axis=1)
    return np.where(count > 0, right / np.maximum(count, 1), 1.0), right / hidden.sum()


def _level(way: str, per_set: list[tuple[list[Answer], float]]) -> dict[str, Any]:
    p, r = (np.mean([x[k] for x in (precision_recall(a, t) for a, t in per_set)], axis=0) for k in (0, 1))
    f1 = 2 * p * r / np.maximum(p + r, 1e-12)
    here = int(np.argmin(np.abs(np.log(FACTORS))))
    return {
        "way": way, "precision": p.tolist(), "recall": r.tolist(), "here": here,
        "average_precision": float(np.mean([detection(a).average_precision for a, _ in per_set])),
        "f1": float(f1[here]), "best_f1": float(f1.max()),
        "near": bool(f1[here] >= f1.max() - NEAR_BEST),
        "novel": float(np.mean([x.judgement == "novel" for a, _ in per_set for x in a])),
    }  # fmt: skip


def _cells(row: dict[str, Any]) -> list[str]:
    return [
        row["way"], f"{row['average_precision']:.3f}", f"{row['f1']:.3f}", f"{row['best_f1']:.3f}",
        "yes" if row["near"] else "no", f"{row['novel']:.3f}",
    ]  # fmt: skip


def _plot(path: Path, levels: list[dict[str, Any]]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, ax = figure(size=(7.5, 5.2))
    for i, row in enumerate(levels):
        ours = row["way"] == "memory"
        color = "black" if ours else COLORS[i % len(COLORS)]
        style = "--" if i >= len(COLORS) and not ours else "-"
        ax.plot(
            row["recall"],
            row["precision"],
            style,
            color=color,
            linewidth=2 if ours else 1.2,
            label=row["way"],
        )
        ax.plot(row["recall"][row["here"]], row["precision"][row["here"]], "*", color=color, markersize=11)
    ax.set(xlabel="recall", ylabel="precision", title="hidden silhouettes called occluded; * at t = e")
    ax.legend(fontsize=8, ncols=2)
    save_figure(fig, path)
