# SPDX-License-Identifier: MIT
"""Film strips of chapter 4 on recordings: unknown objects that grow from a ball while they are tracked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.pictures import around, images, shaded
from experiments.registry import experiment
from experiments.table import Table

COLUMNS = 6
TRUTH_VOXELS = 160
SEEN = 0.5
GUESSED = np.array([150, 110, 200], np.float64)  # surface that no frame has shown
SHORT = {"frames": 90, "voxels": 80}
Picture = NDArray[np.uint8]


@experiment("thesis.4.9", needs=["k1"], chosen_on="nothing", reported_on="k1, the left sponge", short=SHORT)
def sponge(*, data: Path, frames: int = 250, voxels: int = 200, threads: int = 0) -> Table:
    """Figure 4.9: a sponge grows from a ball while hands turn it; below, its shape so far, guessed parts in violet."""
    return _grown("Figure 4.9", data / "k1", 0, frames, voxels, threads)


@experiment("thesis.4.10", needs=["mustard0"], chosen_on="nothing", reported_on="mustard0", short=SHORT)
def in_a_hand(*, data: Path, frames: int = 200, voxels: int = 200, threads: int = 0) -> Table:
    """Figure 4.10, of a hand in a fixed gesture there: here a bottle that a robot takes up and turns."""
    return _grown("Figure 4.10", data / "mustard0", 0, frames, voxels, threads)


@experiment(
    "thesis.4.11", needs=["visp_rbt"], chosen_on="nothing", reported_on="visp_rbt, the dragon", short=SHORT
)
def before_a_camera(*, data: Path, frames: int = 200, voxels: int = 200, threads: int = 0) -> Table:
    """Figure 4.11, of a shoe there: here a dragon before a moving camera."""
    return _grown("Figure 4.11", data / "visp_rbt", 1, frames, voxels, threads)


def _grown(title: str, folder: Path, k: int, frames: int, voxels: int, threads: int) -> Table:
    rows: list[dict[str, Any]] = []
    above: list[tuple[str, Picture]] = []
    below: list[tuple[str, Picture]] = []
    with st.open_sequence(folder) as seq:
        count = min(frames, len(seq))
        shown = {int(i) for i in np.linspace(0, count - 1, COLUMNS)}
        model = next(iter(seq.models.values())) if len(seq.models) == 1 else seq.models[seq.objects[k]]
        truth = st.SDF.from_mesh(model, voxels=TRUTH_VOXELS)
        star = st.Reconstructor(seq.camera, voxels=voxels, threads=threads)
        result = star.start(seq[0], mask=seq.masks(0)[k])
        back = np.linalg.solve(seq.ground_truth[0][k], result.pose)
        for i in range(count):
            frame = seq[i]
            result = star.track(frame) if i else result
            if i in shown:
                mesh = star.mesh()
                points = mesh.vertices @ back[:3, :3].T + back[:3, 3]
                own = np.asarray(mesh.seen) >= SEEN
                off = 1e3 * float(np.median(np.abs(truth(points[own]))))
                rows.append(
                    {"frame": i, "status": str(result.status[0]), "seen": 100 * float(own.mean()), "mm": off}
                )
                lens = seq.camera.depth
                drawn = st.draw(frame, result, star.shape, seq.camera)
                above.append((f"frame {i}", _around(drawn, result.pose, lens, mesh)))
                below.append((f"{100 * own.mean():.0f} % seen", _shape(mesh, result.pose, lens)))
    columns = {
        "frame": "frame:d",
        "status": "status",
        "seen %": "seen:.0f",
        "seen surface, median mm": "mm:.2f",
    }
    picture = {"colour": above, "shape": below}
    notes = ["Distances from the model at its reference pose in frame 0, whose own error is among them."]
    return Table.of(title, columns, rows, notes=notes, picture=lambda: images(picture, 2.2))


def _around(picture: Picture, T: Any, lens: Any, mesh: Any) -> Picture:
    return around(picture, T[:3, 3], lens, 0.7 * float(np.linalg.norm(mesh.bounds[1] - mesh.bounds[0])))


def _shape(mesh: Any, T: Any, lens: Any) -> Picture:
    """The mesh as the camera sees it, shaded; what no frame has shown is violet."""
    painted = st.Mesh(mesh.vertices, mesh.faces, colors=_paint(mesh.seen))
    return _around(shaded(painted, T, lens), T, lens, mesh)


def _paint(seen: Any) -> NDArray[np.uint8]:
    own = np.asarray(seen)[:, None] >= SEEN
    return np.where(own, np.full(3, 225.0), GUESSED).astype(np.uint8)
