# SPDX-License-Identifier: MIT
"""A second recording of an object, another side up: whether it is found, and what the shape gains."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

import sdftrack as st
from experiments.common.protocol import load_mesh, say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.synth.standing import standing
from experiments.table import Table
from sdftrack import geometry

UP = {"over": ([np.pi, 0, 0]), "on its side": ([np.pi / 2, 0, 0])}
SEEN, TRUTH_VOXELS = 0.5, 200
HEAD = ["object", "first", "found_mm", "found_deg", "ok", "mean_mm", "mean_deg", "seen_%", "seen_after_%", "chamfer_mm",
        "chamfer_after_mm", "refined_mm", "seen_off_max_mm"]  # fmt: skip
ALIKE_HEAD = ["body", "tried", "ok", "weak", "lost"]


@experiment(
    "reconstruction.resumed",
    needs=["meshes"],
    chosen_on="the same meshes and bodies, 128 and 80 voxels, other seeds: what refutes another pose",
    reported_on="bunny, spot, lm_can, lm_cat, lm_duck; seeds 3 and 53",
    short={"only": ("spot",), "noise": ("gaussian",), "frames": 8, "voxels": 64, "views": 1},
)
def resumed(
    *,
    data: Path,
    only: tuple[str, ...] = ("bunny", "spot", "lm_can", "lm_cat", "lm_duck"),
    noise: tuple[Literal["gaussian", "kinect"], ...] = ("gaussian", "kinect"),
    frames: int = 60,
    views: int = 6,
    voxels: int = 128,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> list[Table]:
    """An object stands on a table, the camera goes round it; then it stands on its head, or lies, and again.

    Parameters
    ----------
    views
        frames of the second recording in which bodies that look alike from several sides are tried
    """
    settings = {"voxels": voxels, "threads": threads, **options}
    rows = []
    for kind in noise:
        for name in only:
            for how in UP:
                rows.append(
                    _one(f"{name}, {kind}, {how}", load_mesh(data, name), kind, how, frames, settings)
                )
                say("  ".join(rows[-1]))
    return [
        Table(f"two recordings of {frames} frames", HEAD, rows),
        Table("bodies that look alike from several sides", ALIKE_HEAD, _alike(kind, frames, views, settings)),
    ]


def _standing(mesh: Any, kind: str, frames: int, seed: int) -> Any:
    return standing(mesh, frames, 0.001 if kind == "gaussian" else kind, turns=1.0, seed=seed)


def _rebuilt(seq: Any, settings: dict[str, Any]) -> tuple[Any, Any]:
    star = st.Reconstructor(seq.camera, **settings)
    first = star.start(seq[0], mask=seq.masks(0)[0])
    for i in range(1, len(seq)):
        star.track(seq[i])
    return star, np.linalg.solve(first.pose, seq.ground_truth[0][0])


def _one(name: str, mesh: Any, kind: str, how: str, frames: int, settings: dict[str, Any]) -> list[str]:
    turn = geometry.pose(UP[how], np.zeros(3))
    star, own_true = _rebuilt(_standing(mesh, kind, frames, 3), settings)
    truth = st.SDF.from_mesh(mesh, voxels=TRUTH_VOXELS, unit="m")
    share, chamfer, _ = _surface(star, own_true, mesh, truth)
    seq = _standing(mesh.transformed(turn), kind, frames, 53)
    middle = geometry.pose(t_m=mesh.bounds.mean(axis=0))
    # An image in which it is not sure is refused; the next one may do.
    for first in range(frames):
        result = star.resume(seq[first], mask=seq.masks(first)[0])
        if result.ok:
            break
    else:
        return [
            name,
            "none",
            *["-"] * 5,
            f"{100 * share:.0f}",
            "-",
            f"{1e3 * chamfer:.2f}",
            "-",
            "-",
            "-",
        ]
    results = [result, *(star.track(seq[i]) for i in range(first + 1, frames))]
    errors = np.array([
        st.metrics.pose_error(r.pose @ own_true @ middle, seq.ground_truth[first + k][0] @ turn @ middle)
        for k, r in enumerate(results)
    ])  # fmt: skip
    after, chamfer_after, off_m = _surface(star, own_true, mesh, truth)
    star.refine()
    _, refined, _ = _surface(star, own_true, mesh, truth)
    metres, radians = errors[0]
    return [
        name, str(first), f"{1e3 * metres:.2f}", f"{np.degrees(radians):.2f}",
        f"{sum(r.ok for r in results)} / {len(results)}", f"{1e3 * errors[:, 0].mean():.2f}",
        f"{np.degrees(errors[:, 1].mean()):.2f}", f"{100 * share:.0f}", f"{100 * after:.0f}", f"{1e3 * chamfer:.2f}",
        f"{1e3 * chamfer_after:.2f}", f"{1e3 * refined:.2f}", f"{1e3 * off_m:.1f}",
    ]  # fmt: skip


def _surface(star: Any, own_true: Any, mesh: Any, truth: Any) -> tuple[float, float, float]:
    """Share seen; chamfer of the whole surface, its guessed parts too; farthest seen vertex from the truth (m)."""
    found = star.mesh()
    own = found.transformed(np.linalg.inv(own_true))
    off, back = np.abs(truth(own.vertices)), own._rays.closest(mesh.vertices)[0]
    chamfer = 0.5 * float(off.mean() + back.mean())
    return star.quality(found).seen_share, chamfer, float(off[found.seen >= SEEN].max())


def _alike(kind: str, frames: int, views: int, settings: dict[str, Any]) -> list[list[str]]:
    """Bodies of one colour that a turn carries into themselves: none may be joined."""
    bodies = {
        "ball": st.SDF.sphere(0.045, voxels=64),
        "cube": st.SDF.box((0.08, 0.08, 0.08), voxels=64),
        "brick": st.SDF.box((0.12, 0.08, 0.05), voxels=64),
        "can": st.SDF.cylinder(0.035, 0.1, voxels=64),
        "cone": st.SDF.cone(0.04, 0.1, voxels=64),
        "ellipsoid": st.SDF.ellipsoid((0.03, 0.045, 0.06), voxels=64),
    }
    rows = []
    for name, sdf in bodies.items():
        mesh, said = sdf.to_mesh(), []
        star, _ = _rebuilt(_standing(mesh, kind, frames, 3), settings)
        for turn in UP.values():
            seq = _standing(mesh.transformed(geometry.pose(turn, np.zeros(3))), kind, views, 53)
            for i in range(views):
                result = star.resume(seq[i], mask=seq.masks(i)[0])
                said.append(str(result.status[0].value))
                if result.ok:  # then it is another shape; begin again
                    star, _ = _rebuilt(_standing(mesh, kind, frames, 3), settings)
        rows.append([name, str(len(said)), *(str(said.count(s)) for s in ("ok", "weak", "lost"))])
        say("  ".join(rows[-1]))
    return rows
