# SPDX-License-Identifier: MIT
"""Figures 4.15 and 4.16: a camera carried around an object that rests among others, by the object alone and by all.

Set-up: the duck on a table with eight boxes about it, 300 frames, once round it, noise 1 mm; no such recording is
available. "object" is ours: the duck alone is reconstructed, with its true mask in the first frame, and the camera's
path is that in the object's frame. "whole scene" is Open3D's fusion of everything, frame against model, in place of the
Kinect's; it is left out where Open3D is not installed. The constant rigid motion between two paths is taken out by the
camera centres. Printed: the two nearly coincide (no numbers).
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.growing import Scene, reconstructor, scene_of
from experiments.thesis.measures.rebuilt import rebuild
from sdftrack import geometry
from sdftrack.evaluation.tables import text_table

__all__ = ["aligned", "around", "carried", "run"]

SEED, SIGMA_M, TURN_FRAMES = 0, 0.001, 300
UP_RAD, UP_MORE_RAD, AWAY_M, AWAY_MORE_M = np.deg2rad(40), np.deg2rad(6), 0.80, 0.05
TABLE_M, TABLE_RGB, THINGS = (1.6, 1.6, 0.02), (120, 90, 65), 8
THING_M, BESIDE_M = (0.05, 0.14), (0.17, 0.32)  # sides; how far the middle is from the object's side
TRUTH, OURS, WHOLE = "truth", "object", "whole scene"
HEAD = ["paths", "rms_mm", "max_mm", "rms_deg", "max_deg", "not_ok", "printed"]
LEFT_OUT = (
    "The whole scene is left out: it is followed by Open3D, which is not installed (pip install open3d)."
)
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    given = scene_of(context, TURN_FRAMES)
    n = len(given.poses)
    scene = Scene(given.mesh, given.name, carried(given.mesh, n), given.extent, given.threads)
    with tempfile.TemporaryDirectory() as cache:
        seq = _frames(scene, cache)
        live = rebuild(reconstructor(scene, seq), seq, None, n, lambda i, _: context.step(i + 1, n, OURS))
        paths = {TRUTH: geometry.inverse(scene.poses), OURS: geometry.inverse(live.poses)}
        whole = _whole_scene(seq, n, context)
    if whole is not None:
        paths[WHOLE] = whole
    paths = {name: aligned(path, paths[TRUTH]) for name, path in paths.items()}
    not_ok = {OURS: sum(s != "ok" for s in live.status)}
    pairs = [(a, b) for a, b in ((OURS, WHOLE), (OURS, TRUTH), (WHOLE, TRUTH)) if {a, b} <= set(paths)]
    rows = [_row(a, b, paths, not_ok) for a, b in pairs]
    cells = [r.pop("cells") for r in rows]
    title = f"Figure 4.16, {n} frames, a camera carried around {scene.name} on a table"
    notes = [] if whole is not None else [LEFT_OUT]
    write_text(context.out / "table.txt", "\n".join([text_table(title, HEAD, cells), *notes]) + "\n")
    _plot(context.out / "figure.png", paths)
    return {"title": title, "head": HEAD, "rows": cells, "levels": rows, "notes": notes}


def carried(mesh: Any, n: int) -> Array:
    """(n, 4, 4) T_cam_obj of a camera that goes round the object by 1.2 degrees a frame, up and down, near and far."""
    i, middle = np.arange(n), mesh.bounds.mean(axis=0)
    around = 2 * np.pi * i / TURN_FRAMES
    up = UP_RAD + UP_MORE_RAD * np.sin(2 * np.pi * i / 120)
    away = AWAY_M + AWAY_MORE_M * np.sin(2 * np.pi * i / 170)
    toward = np.column_stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
    return np.array([geometry.look_at(eye, middle) for eye in middle + away[:, None] * toward])


def around(mesh: Any, seed: int = SEED) -> Any:
    """The table that the object stands on (z is up) and boxes about it, none of which touches it: one mesh, m."""
    from sdftrack.mesh import Mesh
    from sdftrack.synth.surroundings import box_mesh

    rng = np.random.default_rng([seed, 416])
    (x, y, _), floor = mesh.bounds.mean(axis=0), mesh.bounds[0, 2]
    beside = 0.5 * float(np.ptp(mesh.bounds[:, :2], axis=0).max())
    boxes: list[tuple[Any, Any, float, Any]] = [(TABLE_M, (x, y, floor - 0.5 * TABLE_M[2]), 0.0, TABLE_RGB)]
    for k in range(THINGS):
        size, angle = rng.uniform(*THING_M, 3), 2 * np.pi * (k + rng.uniform(0.2, 0.8)) / THINGS
        far = beside + rng.uniform(*BESIDE_M)
        at = (x + far * np.cos(angle), y + far * np.sin(angle), floor + 0.5 * size[2])
        boxes.append((size, at, rng.uniform(0, np.pi), rng.integers(40, 230, 3)))
    vertices, faces, colors, count = [], [], [], 0
    for size, at, turn, rgb in boxes:
        box = box_mesh(np.array(size))
        vertices.append(geometry.transform_points(geometry.pose((0, 0, turn), at), box.vertices))
        faces.append(box.faces + count)
        colors.append(np.tile(np.uint8(rgb), (len(box.vertices), 1)))
        count += len(box.vertices)
    return Mesh(np.vstack(vertices), np.vstack(faces).astype(np.int32), np.vstack(colors))


def _frames(scene: Scene, cache: str | Path) -> Any:
    """Object 0 is the one, object 1 all that is about it; nothing else is in the pictures."""
    from sdftrack.synth import sequence

    poses = np.stack([scene.poses, scene.poses], axis=1)
    both = [scene.mesh, around(scene.mesh)]
    return sequence(both, len(poses), poses, SIGMA_M, seed=SEED, threads=scene.threads, cache=cache)


def _whole_scene(seq: Any, n: int, context: Context) -> Array | None:
    from experiments.thesis.measures.whole_scene import camera_path

    try:
        return camera_path(seq, n, lambda i: context.step(i + 1, n, WHOLE))
    except ImportError:
        return None


def aligned(path: Array, other: Array) -> Array:
    """`path` (n, 4, 4), moved as a whole so that its camera centres lie on those of `other` as well as they can."""
    a, b = path[:, :3, 3], other[:, :3, 3]
    u, _, vt = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
    T = np.eye(4)
    T[:3, :3] = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    T[:3, 3] = b.mean(axis=0) - T[:3, :3] @ a.mean(axis=0)
    moved: Array = T @ path
    return moved


def _row(one: str, other: str, paths: dict[str, Array], not_ok: dict[str, int]) -> dict[str, Any]:
    a, b = aligned(paths[one], paths[other]), paths[other]
    mm = 1e3 * np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1)
    cosine = 0.5 * (np.einsum("nij,nij->n", a[:, :3, :3], b[:, :3, :3]) - 1)
    deg = np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))
    row: dict[str, Any] = {
        "paths": f"{one} - {other}", "rms_mm": float(np.sqrt(np.mean(mm**2))), "max_mm": float(mm.max()),
        "rms_deg": float(np.sqrt(np.mean(deg**2))), "max_deg": float(deg.max()), "not_ok": not_ok.get(one),
    }  # fmt: skip
    numbers = (f"{row[k]:.2f}" for k in ("rms_mm", "max_mm", "rms_deg", "max_deg"))
    lost = "-" if row["not_ok"] is None else str(row["not_ok"])
    row["cells"] = [row["paths"], *numbers, lost, "nearly coincide" if other == WHOLE else "-"]
    return row


def _plot(path: Any, paths: dict[str, Array]) -> None:
    from scipy.spatial.transform import Rotation

    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, axes = figure(3, 1, size=(9.0, 9.0), sharex=True)
    styles = {TRUTH: ("0.6", 3.0, "-"), OURS: (None, 1.2, "-"), WHOLE: (None, 1.2, "--")}
    for name, T in paths.items():
        color, width, line = styles[name]
        off_mm = 1e3 * (T[:, :3, 3] - paths[TRUTH][:, :3, 3])
        # Turns since the first frame pass 360 degrees, where no three numbers follow them.
        turned = T[:, :3, :3] @ np.swapaxes(paths[TRUTH][:, :3, :3], 1, 2)
        off_deg = np.rad2deg(Rotation.from_matrix(turned).as_rotvec())
        for j in range(3):
            style = {"color": color or COLORS[j], "linewidth": width, "linestyle": line}
            axes[0].plot(1e3 * (T[:, j, 3] - paths[TRUTH][0, j, 3]), label=f"{name}, {'xyz'[j]}", **style)
            axes[1].plot(off_mm[:, j], **style)
            axes[2].plot(off_deg[:, j], **style)
    axes[0].set(ylabel="translation of the camera (mm)", title="grey: truth")
    axes[0].legend(fontsize=8, ncols=len(paths))
    axes[1].set_ylabel("off the truth (mm)")
    axes[2].set(ylabel="turned off the truth (deg)", xlabel="frame")
    save_figure(fig, path)
