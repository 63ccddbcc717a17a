# SPDX-License-Identifier: MIT
"""Figures 4.15 and 4.16: a camera carried around an object that rests among others, by the object alone and by all."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.samples import COLUMNS, evenly
from experiments.data import has
from experiments.pictures import COLORS, GREY, Line, Panel, curves, images, shaded
from experiments.pictures import around as part
from experiments.progress import step
from experiments.reconstruction import fusion
from experiments.reconstruction.growing import SEED, Scene, reconstructor, scene_of
from experiments.reconstruction.rebuilt import rebuild
from experiments.registry import experiment
from experiments.table import Table
from sdftrack import geometry

SIGMA_M, TURN_FRAMES = 0.001, 300
UP_RAD, UP_MORE_RAD, AWAY_M, AWAY_MORE_M = np.deg2rad(40), np.deg2rad(6), 0.80, 0.05
TABLE_M, TABLE_RGB, THINGS = (1.6, 1.6, 0.02), (120, 90, 65), 8
THING_M, BESIDE_M = (0.05, 0.14), (0.17, 0.32)  # sides; how far the middle is from the object's side
TRUTH, OURS, WHOLE = "truth", "object", "whole scene"
LEFT_OUT = (
    "The whole scene is left out: it is followed by Open3D, which is not installed (pip install open3d)."
)
NEAR_M, TABLE_FREE_M = 0.02, 0.004  # of the true surface and the table: the object's part of a reconstruction
SHOWN_M = 0.2  # around the object
FEWEST = 100  # frames, a third of the turn: camera centres along less of it hardly tell how paths are turned
Array = NDArray[np.float64]


@experiment(
    "thesis.4.16",
    uses=["package:open3d"],
    chosen_on="nothing was chosen here",
    reported_on="the built-in duck on a table, seed 0",
    short={"frames": FEWEST},
)
def carried_camera(
    *, frames: int = TURN_FRAMES, mesh: Path | None = None, unit: str | None = None, threads: int = 0
) -> Table:
    """Figure 4.16: a camera carried around an object, by the object and by the whole scene.

    The duck on a table with eight boxes about it, once round it in 300 frames, noise 1 mm; no such recording is
    available. "object" is ours: the duck alone is reconstructed, with its true mask in the first frame, and the
    camera's path is that in the object's frame. "whole scene" is Open3D's fusion of everything, frame against model, in
    place of the Kinect's; it is left out where Open3D is not installed. The constant rigid motion between two paths is
    taken out by the camera centres. Printed: the two nearly coincide (no numbers).

    Parameters
    ----------
    mesh
        instead of the built-in duck
    unit
        of the mesh
    """
    still = scene_of(mesh, unit, frames, threads)
    scene = still.along(carried(still.body.mesh, frames))
    paths, status = _followed(scene)
    paths = {name: aligned(path, paths[TRUTH]) for name, path in paths.items()}
    pairs = [(a, b) for a, b in ((OURS, WHOLE), (OURS, TRUTH), (WHOLE, TRUTH)) if {a, b} <= set(paths)]
    rows = [_row(a, b, paths) for a, b in pairs]
    rows[0]["not_ok"] = sum(s != "ok" for s in status)
    numbers = {f"{how} {unit}": f"{how}_{unit}:.2f" for unit in ("mm", "deg") for how in ("rms", "max")}
    return Table.of(
        f"Figure 4.16, {frames} frames, a camera carried around {scene.body.name} on a table",
        {"paths": "paths", **numbers, "not ok": "not_ok:d", "printed": "printed"},
        rows,
        notes=[] if WHOLE in paths else [LEFT_OUT],
        picture=lambda: _picture(paths),
    )


def _followed(scene: Scene, look: Callable[..., None] | None = None) -> tuple[dict[str, Array], list[str]]:
    """The camera's paths by name, and the statuses of ours.

    `look`, if any, is called after each frame: ours with (OURS, i, frame, reconstructor), the whole scene with (WHOLE,
    i, depth of the model, model of Open3D).
    """
    n = len(scene.poses)
    with tempfile.TemporaryDirectory() as cache:
        seq = _frames(scene, cache)
        star = reconstructor(scene, seq)

        def told(name: str, i: int, *made: Any) -> None:
            step(i + 1, n, name)
            if look is not None:
                look(name, i, *made)

        live = rebuild(star, seq, None, n, lambda i, result: told(OURS, i, seq[i], star, result))
        paths = {TRUTH: geometry.inverse(scene.poses), OURS: geometry.inverse(live.poses)}
        if has("package:open3d", Path()):
            paths[WHOLE] = fusion.camera_path(seq, n, lambda i, *made: told(WHOLE, i, *made))
    return paths, live.status


@experiment(
    "thesis.4.15",
    uses=["package:open3d"],
    chosen_on="nothing was chosen here",
    reported_on="the built-in duck on a table, seed 0",
    short={"frames": FEWEST},
)
def compared(
    *, frames: int = TURN_FRAMES, mesh: Path | None = None, unit: str | None = None, threads: int = 0
) -> Table:
    """Figure 4.15: frames of the comparison of Figure 4.16, and both reconstructions at the end, from six sides.

    The scene of Figure 4.16, of which the thesis has a recording, with a sponge. "object" is ours, drawn over the
    colour image; "whole scene" what Open3D's fusion shows from the camera's place, in place of the Kinect's. Distances
    from the true surface, in the frames that the two have laid in the first frame; of the whole scene the part within
    20 mm. "underside" is what looks down. Printed: both alike to the eye; a false lip on top by the Kinect's, ours
    noisy below, where no camera has been.

    Parameters
    ----------
    mesh
        instead of the built-in duck
    unit
        of the mesh
    """
    still = scene_of(mesh, unit, frames, threads)
    scene = still.along(carried(still.body.mesh, frames))
    shown, lens = set(evenly(frames)), _frames(scene, None).camera.depth
    middle, last = scene.body.middle, {}
    strips: dict[str, list[tuple[str, Any]]] = {"colour": [], OURS: [], WHOLE: []}

    def cut(picture: Any, i: int) -> Any:
        return part(picture, geometry.transform_points(scene.poses[i], middle[None])[0], lens, SHOWN_M)

    def look(name: str, i: int, *made: Any) -> None:
        if i == 0 or i == frames - 1:
            last[name, i] = made
        if i not in shown:
            return
        if name == OURS:
            frame, star, result = made
            strips["colour"].append((f"frame {i}", cut(frame.color, i)))
            strips[OURS].append(("", cut(st.draw(frame, result, star.shape, lens), i)))
        else:
            strips[WHOLE].append(("", cut(_lit(made[0], lens), i)))

    paths, _ = _followed(scene, look)
    to_true = geometry.inverse(scene.poses[0])
    ours = last[OURS, frames - 1][1].mesh()
    surfaces = {OURS: (ours.vertices, ours.faces, to_true @ last[OURS, 0][2].pose)}
    if WHOLE in paths:
        made = last[WHOLE, frames - 1][1].extract_trianglemesh()
        surfaces[WHOLE] = (made.vertex.positions.numpy(), made.triangle.indices.numpy(), to_true)
    truth, rows = scene.body.sdf(), []
    for name, surface in surfaces.items():
        own = _own_part(*surface, truth, float(scene.body.mesh.bounds[0, 2]))
        rows.append({"way": name, **_distances(own, truth)})
        strips[f"{name}, at the end"] = [
            (f"{60 * k} deg", _from_side(own, middle, k, lens)) for k in range(COLUMNS)
        ]
    columns = {f"{of}, median mm": f"{of}:.2f" for of in ("top", "sides", "underside")}
    return Table.of(
        f"Figure 4.15, {frames} frames, {scene.body.name} on a table",
        {"way": "way", **columns},
        rows,
        notes=[] if WHOLE in paths else [LEFT_OUT],
        picture=lambda: images({name: row for name, row in strips.items() if row}, 1.9),
    )


def carried(mesh: Any, n: int) -> Array:
    """(n, 4, 4) T_cam_obj of a camera that goes round the object by 1.2 degrees a frame, up and down, near and far."""
    i, middle = np.arange(n), mesh.bounds.mean(axis=0)
    turn = 2 * np.pi * i / TURN_FRAMES
    up = UP_RAD + UP_MORE_RAD * np.sin(2 * np.pi * i / 120)
    away = AWAY_M + AWAY_MORE_M * np.sin(2 * np.pi * i / 170)
    toward = np.column_stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
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


def _frames(scene: Scene, cache: str | Path | None) -> Any:
    """Object 0 is the one, object 1 all that is about it; nothing else is in the pictures."""
    from sdftrack.synth import sequence

    poses = np.stack([scene.poses, scene.poses], axis=1)
    both = [scene.body.mesh, around(scene.body.mesh)]
    return sequence(both, len(poses), poses, SIGMA_M, seed=SEED, threads=scene.threads, cache=cache)


def aligned(path: Array, other: Array) -> Array:
    """`path` (n, 4, 4), moved as a whole so that its camera centres lie on those of `other` as well as they can."""
    a, b = path[:, :3, 3], other[:, :3, 3]
    u, _, vt = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
    T = np.eye(4)
    T[:3, :3] = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    T[:3, 3] = b.mean(axis=0) - T[:3, :3] @ a.mean(axis=0)
    moved: Array = T @ path
    return moved


def _row(one: str, other: str, paths: dict[str, Array]) -> dict[str, Any]:
    a, b = aligned(paths[one], paths[other]), paths[other]
    mm = 1e3 * np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1)
    cosine = 0.5 * (np.einsum("nij,nij->n", a[:, :3, :3], b[:, :3, :3]) - 1)
    deg = np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))
    row: dict[str, Any] = {"paths": f"{one} - {other}"}
    for unit, off in (("mm", mm), ("deg", deg)):
        row |= {f"rms_{unit}": float(np.sqrt(np.mean(off**2))), f"max_{unit}": float(off.max())}
    return {**row, "printed": "nearly coincide" if other == WHOLE else None}


def _own_part(vertices: Any, faces: Any, T: Array, truth: Any, floor: float) -> Any:
    """A mesh moved by `T` to the true object's frame: its faces near the object, without the table below."""
    at = geometry.transform_points(T, np.asarray(vertices, np.float64))
    own = (np.abs(truth(at)) < NEAR_M) & (at[:, 2] > floor + TABLE_FREE_M)
    return st.Mesh(at, faces[own[faces].all(axis=1)])


def _distances(mesh: Any, truth: Any) -> dict[str, float | None]:
    """Median distance (mm) of its faces from the truth, by where they look; None where there are none."""
    corners = np.asarray(mesh.vertices)[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up = normals[:, 2] / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
    off = 1e3 * np.abs(truth(corners.mean(axis=1)))
    kinds = {"top": up > 0.5, "sides": np.abs(up) <= 0.5, "underside": up < -0.5}
    return {of: float(np.median(off[some])) if some.any() else None for of, some in kinds.items()}


def _from_side(mesh: Any, middle: Array, k: int, lens: Any) -> Any:
    angle = 2 * np.pi * k / COLUMNS
    eye = middle + 0.5 * np.array([np.cos(angle), np.sin(angle), 0.35])
    T = geometry.look_at(eye, middle)
    return part(shaded(mesh, T, lens), geometry.transform_points(T, middle[None])[0], lens, SHOWN_M)


def _lit(depth: Any, lens: Any) -> NDArray[np.uint8]:
    """A depth image as a surface lit from the camera; white without a measurement."""
    points = lens.back_project(np.ascontiguousarray(depth, np.float32)).astype(np.float64)
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    cosine = np.abs(np.einsum("hwk,hwk->hw", normals, points)) / np.maximum(
        np.linalg.norm(normals, axis=-1) * np.linalg.norm(points, axis=-1), 1e-12
    )
    grey = np.where(np.asarray(depth) > 0, GREY * (0.25 + 0.75 * cosine), 255)
    return np.repeat(grey[..., None], 3, axis=2).astype(np.uint8)


def _picture(paths: dict[str, Array]) -> Any:
    from scipy.spatial.transform import Rotation

    styles = {TRUTH: ("0.6", 3.0, "-"), OURS: (None, 1.2, "-"), WHOLE: (None, 1.2, "--")}
    lines: list[list[Line]] = [[], [], []]
    for name, T in paths.items():
        color, width, dash = styles[name]
        # Turns since the first frame pass 360 degrees, where no three numbers follow them.
        turned = T[:, :3, :3] @ np.swapaxes(paths[TRUTH][:, :3, :3], 1, 2)
        values = (
            1e3 * (T[:, :3, 3] - paths[TRUTH][0, :3, 3]),
            1e3 * (T[:, :3, 3] - paths[TRUTH][:, :3, 3]),
            np.rad2deg(Rotation.from_matrix(turned).as_rotvec()),
        )
        for j, axis in enumerate("xyz"):
            style = {"color": color or COLORS[j], "linewidth": width, "linestyle": dash}
            for row, value in zip(lines, values, strict=True):
                label = f"{name}, {axis}" if row is lines[0] else ""
                row.append(Line(np.arange(len(T)), value[:, j], label, style))
    labels = ("translation of the camera (mm)", "off the truth (mm)", "turned off the truth (deg)")
    panels = [[Panel(row, {"ylabel": label}, {"ncols": 3})] for row, label in zip(lines, labels, strict=True)]
    return curves(panels, (9.0, 9.0), sharex=True)
