# SPDX-License-Identifier: MIT
"""Film strips of chapter 3 on recordings: convergence of one frame, a sword on a tracked handle, a hand in the way."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.pictures import around, images
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.io.report_file import result_of
from sdftrack.synth.surroundings import box_mesh

Array = NDArray[np.float64]
STEPS = (0, 1, 2, 4, 8, 30)  # of the optimiser, Figure 3.6
SHIFT_M, TURN_RAD = (0.012, -0.008, 0.010), (0.25, -0.2, 0.15)  # of the first pose of Figure 3.6
SCALE_M = 0.005
SLICE_M = 0.01  # points this near the slice are shown
COLUMNS = 6
HALF_M = 0.16  # shown around the objects


@experiment("thesis.3.6", needs=["k1"], chosen_on="nothing", reported_on="k1, frame 0, the left sponge")
def convergence(*, data: Path, voxels: int = 200) -> Table:
    """Figure 3.6: one frame converges. Points on the SDF, above; the outline on the depth image, below."""
    with st.open_sequence(data / "k1") as seq:
        mesh, truth = next(iter(seq.models.values())), seq.ground_truth[0][0]
        frame = st.Frame(seq[0].depth)
        lens = seq.camera.depth
    sdf = st.SDF.from_mesh(mesh, voxels=voxels)
    start = truth @ st.geometry.pose(TURN_RAD, SHIFT_M)
    energy = st.energy.Energy(sdf, lens, frame, start, scale_m=SCALE_M)
    points = st.energy.back_project(np.asarray(frame.depth), lens)[0]
    rows, top, below = [], [], []
    for n in STEPS:
        found = st.energy.minimize(energy, max_steps=n) if n else None
        x = energy.start if found is None else found.x
        T = x.poses[0]
        moved = st.metrics.pose_error(T, truth)
        cost = energy.cost(x)
        rows.append({"steps": n, "cost": cost, "mm": 1e3 * moved[0], "deg": np.rad2deg(moved[1])})
        top.append((f"{n} steps", _slice(sdf, T, points)))
        below.append((f"cost {cost:.0f}", around(_drawn(frame, T, sdf, lens), truth[:3, 3], lens, HALF_M)))
    picture = {"SDF, 1 cm slice": top, "depth": below}
    columns = {"steps": "steps:d", "cost": "cost:.0f", "mm": "mm:.2f", "deg": "deg:.2f"}
    notes = ["Errors are differences from the reference pose, a fit to the mean of 25 still frames."]
    return Table.of("Figure 3.6", columns, rows, notes=notes, picture=lambda: images(picture, 2.0))


def _drawn(frame: Any, T: Array, shape: Any, lens: Any) -> NDArray[np.uint8]:
    row = {"objects": [{"pose": T.tolist(), "status": "ok", "reason": "", "confidence": 1.0}]}
    return st.draw(frame, result_of(row), shape, lens)


def _slice(sdf: Any, T: Array, points: Array) -> NDArray[np.uint8]:
    """The SDF in the object's xy plane, blue inside and red outside, its zero level and the points near it in black."""
    inside = (np.linalg.inv(T) @ np.c_[points, np.ones(len(points))].T).T[:, :3]
    phi = np.asarray(sdf.values)
    middle = phi[phi.shape[0] // 2]
    share = np.clip(middle / np.abs(middle).max(), -1, 1)[..., None]
    paint = np.where(share < 0, 255 + share * np.array([200, 120, 0]), 255 - share * np.array([0, 120, 200]))
    picture = paint.clip(0, 255).astype(np.uint8)
    edge = np.abs(middle) < 0.6 * sdf.voxel_size
    picture[edge] = 90
    z0 = sdf.origin[2] + sdf.voxel_size * (phi.shape[0] // 2)
    near = inside[np.abs(inside[:, 2] - z0) < 0.5 * SLICE_M]
    at = np.rint((near - sdf.origin) / sdf.voxel_size).astype(int)
    ok = ((at[:, :2] >= 0) & (at[:, :2] < [phi.shape[2], phi.shape[1]])).all(1)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        y, x = (at[ok, 1] + dy).clip(0, phi.shape[1] - 1), (at[ok, 0] + dx).clip(0, phi.shape[2] - 1)
        picture[y, x] = 0
    return picture


def sword(handle_m: float) -> st.Mesh:
    """A blade, a guard and a pommel along z of an object of this length, as the virtual sword of Figure 3.7."""
    blade, guard = 4.0 * handle_m, 0.15 * handle_m
    parts = (
        ((0.05, 0.012, blade), 0.5 * handle_m + guard + 0.5 * blade, (200, 210, 230)),
        ((0.22, 0.03, guard), 0.5 * (handle_m + guard), (200, 160, 60)),
        ((0.05, 0.05, guard), -0.5 * (handle_m + guard), (200, 160, 60)),
    )
    boxes = [box_mesh(np.array(size)) for size, _, _ in parts]
    vertices = [box.vertices + np.array([0, 0, z]) for box, (_, z, _) in zip(boxes, parts, strict=True)]
    faces = [box.faces + 8 * k for k, box in enumerate(boxes)]  # eight corners each
    colors = np.repeat([rgb for _, _, rgb in parts], 8, axis=0).astype(np.uint8)
    return st.Mesh(np.concatenate(vertices), np.concatenate(faces), colors=colors)


@experiment(
    "thesis.3.7",
    needs=["k1"],
    chosen_on="nothing",
    reported_on="k1, both sponges",
    short={"frames": 120, "voxels": 60},
)
def with_a_sword(*, data: Path, frames: int = 250, voxels: int = 200) -> Table:
    """Figure 3.7: a whole sequence; the tracked depth above, and below a virtual sword on the left sponge."""
    rows, pictures = _followed(data, frames, voxels, np.linspace(0, frames - 1, COLUMNS), True)
    return _strip("Figure 3.7", rows, pictures)


@experiment(
    "thesis.3.8",
    needs=["k1"],
    chosen_on="nothing",
    reported_on="k1, both sponges",
    short={"frames": 200, "voxels": 60},
)
def hidden_by_hands(*, data: Path, frames: int = 250, voxels: int = 200) -> Table:
    """Figure 3.8: objects that hands hold and hide, tracked in depth alone; above the depth, below the colour."""
    rows, pictures = _followed(data, frames, voxels, np.linspace(0.5 * frames, frames - 1, COLUMNS), False)
    return _strip("Figure 3.8", rows, pictures)


def _followed(
    data: Path, frames: int, voxels: int, shown: Array, armed: bool
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """How often each sponge of k1 is found in its depth images, and two pictures of each frame of `shown`."""
    above, below, statuses = [], [], []
    with st.open_sequence(data / "k1") as seq:
        mesh, truth = next(iter(seq.models.values())), seq.ground_truth[0]
        poses = [truth[k] for k in sorted(truth)]
        shapes = [st.SDF.from_mesh(mesh, voxels=voxels)] * len(poses)
        tracker = st.Tracker(shapes, seq.camera, mode="depth")
        arms = (
            [sword(float((mesh.bounds[1] - mesh.bounds[0])[2])), *[None] * (len(poses) - 1)]
            if armed
            else None
        )
        for i in range(frames):
            frame = seq[i]
            result = tracker.start(frame, poses=poses) if i == 0 else tracker.track(frame)
            statuses.append([str(s) for s in result.status])
            if i in shown.astype(int):
                lens, bare = seq.camera.depth, st.Frame(frame.depth)
                pair = st.draw(bare, result, shapes, lens), st.draw(frame, result, shapes, seq.camera, arms)
                if not armed:
                    middle = result.poses[:, :3, 3].mean(axis=0)
                    pair = around(pair[0], middle, lens, HALF_M), around(pair[1], middle, lens, HALF_M)
                above.append((f"frame {i}", pair[0]))
                below.append(("", pair[1]))
    rows = []
    for k in range(len(poses)):
        own = [s[k] for s in statuses]
        rows.append(
            {"name": f"sponge {k}", "frames": frames, **{s: own.count(s) for s in ("ok", "weak", "lost")}}
        )
    return rows, {"depth": above, "colour": below}


def _strip(title: str, rows: list[Any], pictures: dict[str, Any]) -> Table:
    columns = {"sponge": "name", "frames": "frames:d", "ok": "ok:d", "weak": "weak:d", "lost": "lost:d"}
    return Table.of(title, columns, rows, picture=lambda: images(pictures, 2.4))
