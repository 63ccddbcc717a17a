# SPDX-License-Identifier: MIT
"""Scores as a table and as plots."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sdftrack.evaluation.object_score import ObjectScore

HEAD = [
    "object",
    "frames",
    "with truth",
    "lost",
    "mean mm",
    "median mm",
    "max mm",
    "mean deg",
    "median deg",
    "max deg",
    "ADD mm",
    "ADD auc",
    "ADD-S mm",
    "MSSD mm",
    "MSPD px",
    "VSD",
    "AR",
]


def table_rows(scores: list[ObjectScore]) -> list[list[str]]:
    """Rows under `HEAD`."""
    rows = []
    for score in scores:
        d = score.to_dict()

        def shown(part: str, key: str, d: dict[str, Any] = d) -> str:
            value = d[part][key]
            return "-" if value is None else f"{value:.3f}"

        rows.append(
            [score.name, str(score.frames), str(score.compared), str(score.lost)]
            + [shown(p, key) for p in ("translation_mm", "rotation_deg") for key in ("mean", "median", "max")]
            + [shown("add_mm", "mean"), "-" if d["add_auc"] is None else f"{d['add_auc']:.3f}"]
            + [shown("adds_mm", "mean"), shown("mssd_mm", "mean")]
            + [shown("mspd_px", "mean"), shown("vsd", "mean")]
            + ["-" if d["average_recall"] is None else f"{d['average_recall']['AR']:.3f}"]
        )
    return rows


def plot_errors(scores: list[ObjectScore], path: Path) -> None:
    """Translation and rotation error over the images, one curve per object."""
    from sdftrack.viz.plots import figure, save_figure

    fig, axes = figure(2, 1, size=(8.0, 5.0), sharex=True)
    for score in scores:
        marker = "o" if len(score.images) < 20 else None
        axes[0].plot(score.images, 1e3 * score.translation_m, label=score.name, marker=marker)
        axes[1].plot(score.images, np.rad2deg(score.rotation_rad), label=score.name, marker=marker)
    axes[0].set_ylabel("translation error (mm)")
    axes[1].set_ylabel("rotation error (deg)")
    axes[1].set_xlabel("image")
    for a in axes:
        a.set_ylim(bottom=0)
    axes[0].legend()
    save_figure(fig, path)


def plot_trajectories(scores: list[ObjectScore], path: Path) -> None:
    """Position over the images, truth as a dashed line."""
    from sdftrack.viz.plots import figure, save_figure

    fig, axes = figure(3, 1, size=(8.0, 6.0), sharex=True)
    for score in scores:
        for j, a in enumerate(axes):
            line = a.plot(score.images, 1e3 * score.poses[:, j, 3], label=score.name)[0]
            a.plot(score.images, 1e3 * score.truth[:, j, 3], "--", color=line.get_color(), alpha=0.6)
            a.set_ylabel(f"{'xyz'[j]} (mm)")
    axes[0].legend(title="dashed: truth")
    axes[-1].set_xlabel("image")
    save_figure(fig, path)
