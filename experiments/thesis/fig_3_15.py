# SPDX-License-Identifier: MIT
"""Figure 3.15: a plane patch is fitted to any part of the ground, extended, and the ground near it is taken out.

Set-up: the recorded scene `learn33` (things on a table) where SDFTRACK_DATA names a folder with the part `osd`, three
synthetic boxes otherwise; both ways start at the middle of the largest free part of the table. Upper row: as printed,
the patch extended without refitting, a constant tolerance. Lower row: refitted to all measurements near it, a slab that
knows the noise, feet of objects kept. Printed: the three pictures, no numbers.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.table_scene import TableScene, table_scene
from experiments.thesis import Context
from experiments.thesis.measures.table_shares import removed
from experiments.thesis.scenes.table_scenes import open_scenes
from sdftrack.evaluation.tables import text_table

__all__ = ["middle_of_table", "run"]

RECORDED = "learn33"
HEAD = ["way", "table %", "above 10 mm %", "objects %", "normal deg", "printed"]
ROWS = (("printed", "the patch extended as it is"), ("rigid", "refitted, slab by the noise, feet kept"))
PATCH, PLANE, LEFT_OUT = (230, 60, 40), (60, 110, 230), (245, 245, 245)
Picture = NDArray[np.uint8]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    import sdftrack as st
    from sdftrack._internal.files import write_text

    scene = _scene()
    at = middle_of_table(scene)
    levels: list[dict[str, Any]] = []
    made = []
    for k, (method, what) in enumerate(ROWS):
        mask, (n, _) = st.remove_plane(scene.frame, scene.camera, start_px=at, method=method)
        off = np.degrees(np.arccos(np.clip(n @ _table_normal(scene), -1, 1)))
        levels.append({"way": what, **removed(scene, mask), "normal_deg": float(off)})
        made.append((what, mask))
        context.step(k + 1, len(ROWS), method)
    cells = [
        [
            r["way"], f"{r['table']:.2f}", f"{r['high']:.2f}", f"{r['objects']:.2f}", f"{r['normal_deg']:.2f}",
            "pictures only",
        ]
        for r in levels
    ]  # fmt: skip
    title = f"Figure 3.15, scene {scene.name}, shares taken out, patch at {at}"
    write_text(context.out / "table.txt", text_table(title, HEAD, cells) + "\n")
    _plot(context.out / "figure.png", scene, at, made)
    return {"title": title, "head": HEAD, "rows": cells, "levels": levels}


def _scene() -> TableScene:
    data = os.environ.get("SDFTRACK_DATA")
    if data and (Path(data) / "osd").is_dir():
        named = {s.name: s for s in open_scenes(Path(data))}
        return named.get(RECORDED, next(iter(named.values())))
    return table_scene()


def middle_of_table(scene: TableScene) -> tuple[int, int]:
    """The pixel of the table that is farthest from everything else."""
    import cv2

    free = cv2.distanceTransform(np.pad(scene.table, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    y, x = np.unravel_index(int(np.argmax(free)), free.shape)
    return int(x), int(y)


def _table_normal(scene: TableScene) -> NDArray[np.float64]:
    points = scene.camera.back_project(scene.frame.depth)[scene.table]
    spread = points - points.mean(axis=0)
    n: NDArray[np.float64] = np.linalg.eigh(spread.T @ spread)[1][:, 0]
    return -n if n @ points.mean(axis=0) > 0 else n


def _shaded(scene: TableScene) -> Picture:
    """The depth image in grey, near is bright; black without a measurement."""
    z = scene.frame.depth
    low, high = np.percentile(z[z > 0], [1, 99])
    grey = np.where(z > 0, 60 + 160 * np.clip((high - z) / (high - low), 0, 1), 0)
    return np.repeat(grey[..., None], 3, axis=-1).astype(np.uint8)


def _tinted(picture: Picture, where: NDArray[np.bool_], color: tuple[int, int, int]) -> Picture:
    out = picture.copy()
    out[where] = (0.45 * out[where] + 0.55 * np.array(color)).astype(np.uint8)
    return out


def _plot(
    path: Path, scene: TableScene, at: tuple[int, int], made: list[tuple[str, NDArray[np.bool_]]]
) -> None:
    from sdftrack.viz.plots import figure, save_figure

    fig, axes = figure(len(made), 3, size=(11.0, 2.9 * len(made)))
    depth, read = _shaded(scene), scene.frame.depth > 0
    half = max(2, scene.camera.width // 40)
    patch = np.zeros(read.shape, bool)
    patch[max(0, at[1] - half) : at[1] + half + 1, max(0, at[0] - half) : at[0] + half + 1] = True
    for row, (what, mask) in zip(axes, made, strict=True):
        on_plane = read & ~mask
        left = np.where((read & mask)[..., None], depth, np.uint8(0))
        left[~(read & mask)] = LEFT_OUT
        extended = _tinted(_tinted(depth, on_plane, PLANE), patch & read, PATCH)
        pictures = (_tinted(depth, patch & read, PATCH), extended, left)
        for ax, picture, title in zip(
            row, pictures, ("a) patch", "b) extended", "c) taken out"), strict=True
        ):
            ax.imshow(picture)
            ax.set_title(f"{title}: {what}" if ax is row[1] else title, fontsize=9)
            ax.set_axis_off()
    save_figure(fig, path)
