# SPDX-License-Identifier: MIT
"""Figure 3.15: a plane patch is fitted to any part of the ground, extended, and the ground near it is taken out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.data import has
from experiments.pictures import images
from experiments.planes.planes import scene_row
from experiments.planes.table_scenes import open_scenes
from experiments.registry import experiment
from experiments.synth.table_scene import TableScene, table_scene
from experiments.table import Table

RECORDED = "learn33"
ROWS = {"printed": "the patch extended as it is", "rigid": "refitted, slab by the noise, feet kept"}
PATCH, PLANE, LEFT_OUT = (230, 60, 40), (60, 110, 230), (245, 245, 245)
Mask = NDArray[np.bool_]
Picture = NDArray[np.uint8]


@experiment(
    "thesis.3.15",
    uses=["osd"],
    chosen_on="nothing was chosen here",
    reported_on="learn33 of osd, or synthetic boxes",
)
def ground(*, data: Path) -> Table:
    """Figure 3.15: a ground plane: patch fitted, extended, taken out.

    The recorded scene `learn33` (things on a table) where the data have the part `osd`, three synthetic boxes
    otherwise; both ways start at the middle of the largest free part of the table. First row: as printed, the patch
    extended without refitting, a constant tolerance. Second row: refitted to all measurements near it, a slab that
    knows the noise, feet of objects kept. Printed: the three pictures, no numbers.
    """
    scene = scene_of(data)
    at = middle_of_table(scene)
    made = {what: scene_row(scene, method, at, calls=1) for method, what in ROWS.items()}
    columns = {"way": "way", "table %": "table:.2f", "above 10 mm %": "high:.2f", "objects %": "objects:.2f"}
    return Table.of(
        f"Figure 3.15, scene {scene.name}, shares taken out, patch at {at}",
        {**columns, "normal deg": "deg:.2f", "printed": "printed"},
        [{"way": what, **row, "printed": "pictures only"} for what, (row, _) in made.items()],
        picture=lambda: images(stages(scene, at, {what: mask for what, (_, mask) in made.items()}), 3.6),
    )


def scene_of(data: Path) -> TableScene:
    """The recorded scene, or a synthetic one where it is not at hand."""
    scenes = {s.name: s for s in open_scenes(data)} if has("osd", data) else {}
    return scenes.get(RECORDED) or next(iter(scenes.values()), None) or table_scene()


def middle_of_table(scene: TableScene) -> tuple[int, int]:
    """The pixel of the table that is farthest from everything else."""
    import cv2

    free = cv2.distanceTransform(np.pad(scene.table, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    y, x = np.unravel_index(int(np.argmax(free)), free.shape)
    return int(x), int(y)


def stages(
    scene: TableScene, at: tuple[int, int], left: dict[str, Mask]
) -> dict[str, list[tuple[str, Picture]]]:
    """Patch, extended plane and what is left (by way), for pictures."""
    depth, read = _shaded(scene), scene.frame.depth > 0
    half = max(2, scene.camera.width // 40)
    patch = np.zeros(read.shape, bool)
    patch[max(0, at[1] - half) : at[1] + half + 1, max(0, at[0] - half) : at[0] + half + 1] = True
    out = {}
    for what, mask in left.items():
        rest = np.where((read & mask)[..., None], depth, np.uint8(0))
        rest[~(read & mask)] = LEFT_OUT
        extended = _tinted(_tinted(depth, read & ~mask, PLANE), patch & read, PATCH)
        out[what] = [
            ("a) patch", _tinted(depth, patch & read, PATCH)),
            ("b) extended", extended),
            ("c) taken out", rest),
        ]
    return out


def _shaded(scene: TableScene) -> Picture:
    """The depth image in grey, near is bright; black without a measurement."""
    z = scene.frame.depth
    low, high = np.percentile(z[z > 0], [1, 99])
    grey = np.where(z > 0, 60 + 160 * np.clip((high - z) / (high - low), 0, 1), 0)
    return np.repeat(grey[..., None], 3, axis=-1).astype(np.uint8)


def _tinted(picture: Picture, where: Mask, color: tuple[int, int, int]) -> Picture:
    out = picture.copy()
    out[where] = (0.45 * out[where] + 0.55 * np.array(color)).astype(np.uint8)
    return out
