# SPDX-License-Identifier: MIT
"""Figure 5.8: two look-alikes at rest, seen by a camera that moves: how steady is their relative pose?

Set-up: 200 frames of depth and colour, noise 1 mm and 5 grey levels, a gap of 3 mm, the camera keeps facing the
pair. The thesis' recording is not available: this one is synthetic. Printed: the joint tracker is much steadier in
translation and rotation (no numbers).
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.several import still_pair
from experiments.thesis import Context
from experiments.thesis.look_alikes import name_of, pair_of, ways
from experiments.thesis.measures.identity import run_way
from sdftrack import geometry
from sdftrack.evaluation.tables import text_table

__all__ = ["relative_motion", "run"]

FRAMES, SEED = 200, 0
HEAD = ["way", "sd mm", "range mm", "sd deg", "range deg", "lost", "printed"]
Array = NDArray[np.float64]


def relative_motion(poses: Array) -> tuple[Array, Array]:
    """(n,) metres and radians by which the pose of object 1 in object 0's frame is off its mean; poses (n, 2, 4, 4)."""
    between = geometry.inverse(poses[:, 0]) @ poses[:, 1]
    u, _, vt = np.linalg.svd(between[:, :3, :3].mean(axis=0))
    mean = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    off = between[:, :3, 3] - between[:, :3, 3].mean(axis=0)
    cosine = 0.5 * (np.einsum("ij,nij->n", mean, between[:, :3, :3]) - 1)
    return np.linalg.norm(off, axis=1), np.arccos(np.clip(cosine, -1, 1))


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    mesh, solid = pair_of(context)
    n = FRAMES if context.frames is None else context.frames
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        scene = still_pair(
            mesh,
            solid,
            n,
            SEED,
            color=True,
            threads=int(context.options.get("threads", 0)),
            cache=Path(cache),
        )
        names = ways(solid, scene.camera)
        for k, way in enumerate(names):
            tracked = run_way(scene, way, "rgbd", context.options)
            metres, radians = relative_motion(tracked.poses)
            rows.append(
                {
                    "way": way,
                    "mm": (1e3 * metres).tolist(),
                    "deg": np.rad2deg(radians).tolist(),
                    "sd_mm": 1e3 * float(np.sqrt(np.mean(metres**2))),
                    "range_mm": 1e3 * float(metres.max()),
                    "sd_deg": float(np.rad2deg(np.sqrt(np.mean(radians**2)))),
                    "range_deg": float(np.rad2deg(radians.max())),
                    "lost": int(np.count_nonzero(tracked.lost)),
                }
            )
            context.step(k + 1, len(names), way)
    cells = [
        [
            r["way"], f"{r['sd_mm']:.3f}", f"{r['range_mm']:.3f}", f"{r['sd_deg']:.3f}", f"{r['range_deg']:.3f}",
            str(r["lost"]), "-" if r["way"] == "single" else "much steadier",
        ]
        for r in rows
    ]  # fmt: skip
    title = f"Figure 5.8, {n} frames, relative pose of two copies of {name_of(context)} about its mean"
    write_text(context.out / "table.txt", text_table(title, HEAD, cells) + "\n")
    _plot(context.out / "figure.png", rows)
    return {"title": title, "head": HEAD, "rows": cells, "levels": rows}


def _plot(path: Any, rows: list[dict[str, Any]]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, axes = figure(2, 1, size=(9.0, 6.0), sharex=True)
    for ax, key, label in (
        (axes[0], "mm", "translation off its mean (mm)"),
        (axes[1], "deg", "rotation (deg)"),
    ):
        for k, r in enumerate(rows):
            ax.plot(r[key], color=COLORS[k % len(COLORS)], label=r["way"], linewidth=1.1)
        ax.set_ylabel(label)
        ax.set_ylim(bottom=0)
    axes[0].legend(fontsize=8)
    axes[1].set_xlabel("frame")
    save_figure(fig, path)
