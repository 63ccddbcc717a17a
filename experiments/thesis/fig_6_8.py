# SPDX-License-Identifier: MIT
"""Figure 6.8: the two failures of the regression, on the hand: many small occluders, and no detail in sight.

Set-up: all frames of the synthetic hand learnt; a fence, or all but a disc inside hidden. Printed: pictures of wrong
shapes by 8-10 -> 1-7 or a like split; both cases may be found to be "not learnt", which is not guaranteed.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.measures.shape_protocol import FRAMES, Case, cases, gaits, learnt
from experiments.thesis.silhouettes import NOTE
from sdftrack.contour.masks import signed_distances
from sdftrack.contour.result import Assessment
from sdftrack.evaluation.tables import text_table
from sdftrack.metrics import iou

__all__ = ["run"]

Mask: TypeAlias = NDArray[np.bool_]
RULES = {"LWPR 8-10 -> 1-7": "printed", "memory": "remembered"}
FENCE = 0.4  # share hidden
EVERY = 8  # frames
SHOWN = 0.4  # of the queries


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    masks = gaits(FRAMES["hand"] if context.frames is None else context.frames)["hand"]
    asked = masks[::EVERY]
    hidden = {
        "many small occluders": cases(asked, (FENCE,), "fence"),
        "no detail in sight": [_inside_alone(mask) for mask in asked],
    }
    said: dict[str, dict[str, list[Assessment]]] = {}
    for i, (name, rule) in enumerate(RULES.items()):
        context.step(i, len(RULES), name)
        memory = learnt(masks, rule=rule, capacity=512, settle=min(20, len(masks)))
        said[name] = {what: [memory.assess(c.seen) for c in some] for what, some in hidden.items()}
    rows, levels = [], []
    for what, some in hidden.items():
        for name, answers in said.items():
            level = {"hidden": what, "way": name, **_level(some, answers[what])}
            levels.append(level)
            rows.append([what, name, *_cells(level)])
    head = ["hidden", "way", "visible part", "completed", "accepted", "novel", "occluded", "unoccluded"]
    rows.append(["printed", "wrong shapes, pictures only", *("" for _ in head[2:])])
    title = f"Figure 6.8, the hand, {len(masks)} frames: overlaps, shares of judgements; {NOTE}"
    write_text(context.out / "table.txt", text_table(title, head, rows) + "\n")
    _plot(context.out / "figure.png", hidden, said)
    return {"title": title, "head": head, "rows": rows, "levels": levels}


def _inside_alone(mask: Mask) -> Case:
    """A disc that lies inside and meets the outline nowhere."""
    phi = signed_distances(mask)
    y, x = np.unravel_index(int(phi.argmin()), phi.shape)
    rows, columns = np.indices(mask.shape)
    seen = np.hypot(columns - x, rows - y) < -0.7 * phi.min()
    return Case(mask, seen, 1 - float(seen.sum() / mask.sum()))


def _level(some: list[Case], answers: list[Assessment]) -> dict[str, Any]:
    judged = Counter[str](a.judgement for a in answers)
    both = list(zip(some, answers, strict=True))
    return {
        "seen": float(np.mean([iou(c.seen, c.whole) for c in some])),
        "completed": float(np.mean([iou(a.completed, c.whole) for c, a in both])),
        "accepted": float(np.mean([iou(a.mask, c.whole) for c, a in both])),
        "judgements": {j: judged[j] / len(some) for j in ("novel", "occluded", "unoccluded")},
    }


def _cells(level: dict[str, Any]) -> list[str]:
    overlaps = [f"{level[k]:.3f}" for k in ("seen", "completed", "accepted")]
    return [*overlaps, *(f"{x:.2f}" for x in level["judgements"].values())]


def _plot(path: Path, hidden: dict[str, list[Case]], said: dict[str, dict[str, list[Assessment]]]) -> None:
    from sdftrack.viz.plots import figure, save_figure

    fig, axes = figure(len(hidden), 2 + len(said), size=(2.2 * (2 + len(said)), 2.5 * len(hidden)))
    for row, (what, some) in zip(axes, hidden.items(), strict=True):
        k = int(SHOWN * len(some))
        case = some[k]
        pictures = [("silhouette", case.whole), (what, case.seen)]
        for name, answers in said.items():
            answer = answers[what][k]
            pictures.append((f"{name}: {answer.judgement},\n{iou(answer.mask, case.whole):.2f}", answer.mask))
        for ax, (title, mask) in zip(row, pictures, strict=True):
            ax.imshow(mask, cmap="gray", vmin=0, vmax=1)
            ax.set_title(title, fontsize=8)
            ax.set_axis_off()
    save_figure(fig, path)
