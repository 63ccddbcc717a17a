# SPDX-License-Identifier: MIT
"""Common part of Figures 6.6 and 6.7: a contour tracker with and without a memory while something passes in front.

The thesis' videos are not available. A synthetic figure with a bar that sweeps over it takes their place.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.gait_video import GaitVideo, gait_video
from experiments.thesis import Context
from sdftrack.evaluation.tables import text_table
from sdftrack.metrics import iou

__all__ = ["followed"]

FRAMES = 160
WAYS = ("without memory", "with memory")
SHOWN = (-3, 0.25, 0.4, 0.55, 0.7, 0.85, 3)  # frames before, shares of the occlusion, frames after


def followed(context: Context, kind: str, title: str) -> dict[str, Any]:
    """Track the video twice: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    n = FRAMES if context.frames is None else max(16, context.frames)
    during = (n * 5 // 8, n * 15 // 16)
    video = gait_video(kind, n, during=during)
    masks = {}
    for i, way in enumerate(WAYS):
        context.step(i, len(WAYS), way)
        masks[way] = _masks(video, way == WAYS[1], min(60, n // 2))
    parts = {"before": range(n // 2, during[0]), "during": range(*during), "after": range(during[1], n)}
    overlap = {
        way: {part: _mean(found, video.whole, which) for part, which in parts.items()}
        for way, found in masks.items()
    }
    overlap["visible part"] = {part: _mean(video.seen, video.whole, which) for part, which in parts.items()}
    head = ["way", *parts]
    rows = [[way, *(f"{x:.3f}" for x in values.values())] for way, values in overlap.items()]
    rows.append(["printed", "alike", "correct with memory, corrupted without", "pictures only"])
    title = f"{title}, {n} frames; mean overlap with the whole silhouette"
    write_text(context.out / "table.txt", text_table(title, head, rows) + "\n")
    _plot(context.out / "figure.png", video, masks)
    return {"title": title, "head": head, "rows": rows, "overlap": overlap}


def _masks(video: GaitVideo, with_memory: bool, burn_in: int) -> list[NDArray[np.bool_]]:
    """The tracked mask of each frame; the first is given."""
    from sdftrack.contour.memory import ShapeMemory
    from sdftrack.contour.tracker import ContourTracker

    tracker = ContourTracker(memory=ShapeMemory() if with_memory else None, burn_in=burn_in)
    tracker.start(video.images[0], mask=video.whole[0])
    return [video.whole[0], *(tracker.track(image).mask for image in video.images[1:])]


def _mean(found: list[NDArray[np.bool_]], whole: list[NDArray[np.bool_]], which: range) -> float:
    return float(np.mean([iou(found[k], whole[k]) for k in which]))


def _plot(path: Path, video: GaitVideo, masks: dict[str, list[NDArray[np.bool_]]]) -> None:
    from sdftrack.viz.plots import figure, save_figure

    first, last = video.during.start, video.during.stop
    shown = [
        first + s if s < 0 else last - 1 + s if s > 1 else int(first + s * (last - first)) for s in SHOWN
    ]
    fig, axes = figure(len(masks), len(shown), size=(1.7 * len(shown), 3.9), squeeze=False)
    for row, (way, found) in zip(axes, masks.items(), strict=True):
        for ax, k in zip(row, np.clip(shown, 0, len(video.images) - 1), strict=True):
            y, x = np.nonzero(video.whole[k])
            half = 0.7 * max(np.ptp(x), np.ptp(y))
            ax.imshow(video.images[k])
            if found[k].any():
                ax.contour(found[k], [0.5], colors="yellow", linewidths=1.4)
            ax.set_xlim((x.min() + x.max()) / 2 + np.array([-half, half]))
            ax.set_ylim((y.min() + y.max()) / 2 + np.array([half, -half]))
            ax.set_title(f"{k}: {iou(found[k], video.whole[k]):.2f}", fontsize=8)
            ax.set_xticks([])
            ax.set_yticks([])
        row[0].set_ylabel(way, fontsize=8)
    save_figure(fig, path)
