# SPDX-License-Identifier: MIT
"""Figure 4.14: error of the surface while it grows, for five reaches sigma_d of the evidence.

Set-up: the scene of Figure 4.13 (b), 1 mm of noise, the thesis' evolution and tracker (``evolution="printed"``) with
sigma_d of 4 to 40 voxels; and ours. The error is the mean distance of points all over the truth, seen or not, to the
surface as it is, after the two have been aligned anew. Printed: 6 mm at the start for all; below 20 voxels it falls and
settles near frame 150; at 20 the error stays large; at 40 the object is too thick after a few frames, then tracking is
lost.
"""

from __future__ import annotations

import tempfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.tracked_scene import WRONG_M, WRONG_RAD
from experiments.thesis import Context
from experiments.thesis.growing import VOXELS, Scene, reconstructor, scene_of
from experiments.thesis.measures.rebuilt import rebuild, relative_errors, settled_at
from experiments.thesis.measures.seen_part import sampled
from sdftrack import geometry
from sdftrack.evaluation.tables import text_table

__all__ = ["aligned_error", "run"]

SIGMA_M, POINTS, LOOK_EVERY, STEPS = 0.001, 4000, 10, 6
OURS = "ours"
SIGMAS_VOXELS = (4.0, 8.0, 12.0, 20.0, 40.0)
BELOW = "6 mm at the start, falls, settles near frame 150"
PRINTED = {20.0: "right shape, large error", 40.0: "too thick, then lost"}
HEAD = [
    *(
        "sigma_d",
        "mm_at_start",
        "mm_at_150",
        "mm_at_end",
        "settled",
        "max_mm",
        "max_deg",
        "not_ok",
        "lost_at",
    ),
    "printed",
]
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    scene = scene_of(context)
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        seq = scene.frames(SIGMA_M, cache)
        for voxels in (*SIGMAS_VOXELS, None):
            rows.append(_follow(scene, seq, voxels, context))
    cells = [_cells(r) for r in rows]
    title = f"Figure 4.14, {len(scene.poses)} frames of {scene.name}, {VOXELS} voxels of {1e3 * scene.voxel_m:.2f} mm"
    write_text(context.out / "table.txt", text_table(title, HEAD, cells) + "\n")
    _plot(context.out / "figure.png", rows)
    return {"title": title, "head": HEAD, "rows": cells, "levels": rows}


def aligned_error(shape: Any, points: Array, T: Array) -> tuple[float, Array]:
    """Mean distance of points to a shape after the rigid motion that makes the sum of squares least, and the motion.

    `T` brings the points near; Gauss-Newton steps do the rest.
    """
    for _ in range(STEPS):
        at = geometry.transform_points(T, points)
        normal = shape.gradient(at)
        J = np.hstack([np.cross(at, normal), normal])
        x = np.linalg.solve(J.T @ J + 1e-9 * np.eye(6), -J.T @ shape(at))
        T = geometry.pose(x[:3], x[3:]) @ T
    return float(np.abs(shape(geometry.transform_points(T, points))).mean()), T


def _distances(shape: Any) -> Any:
    """A shape whose field is a distance; the thesis' evolution leaves one that is steeper."""
    from sdftrack import levelset
    from sdftrack.sdf import SDF

    field = levelset.redistance(shape.values, shape.voxel_size)
    return SDF(field, shape.voxel_size, shape.origin)


def _follow(scene: Scene, seq: Any, voxels: float | None, context: Context) -> dict[str, Any]:
    """One reconstruction, looked at every few frames."""
    star = reconstructor(scene, seq, voxels)
    points, _ = sampled(scene.mesh, POINTS)
    n, name = len(scene.poses), OURS if voxels is None else f"{voxels:g} voxels"
    looks: list[int] = []
    errors: list[float] = []
    T: Array | None = None

    def look(i: int, result: Any) -> None:
        nonlocal T
        context.step(i + 1, n, name)
        if i % LOOK_EVERY == 0 or i == n - 1:
            if T is None:  # only the first frame tells where the object frame was laid
                T = geometry.inverse(result.poses[0]) @ scene.poses[0]
            shape = star.shape if voxels is None else _distances(star.shape)
            error, T = aligned_error(shape, points, T)
            looks.append(i)
            errors.append(error)

    live = rebuild(star, seq, None, n, look)
    e = relative_errors(live.poses, scene.poses, scene.middle)
    wrong = np.flatnonzero((e.metres > WRONG_M) | (e.radians > WRONG_RAD))
    return {
        "sigma_d": name, "looks": looks, "surface_mm": [1e3 * x for x in errors],
        "settled": settled_at(np.array(looks), np.array(errors)), "max_mm": 1e3 * float(e.metres.max()),
        "max_deg": float(np.rad2deg(e.radians.max())), "not_ok": sum(s != "ok" for s in live.status),
        "lost_at": int(wrong[0]) if len(wrong) else None,
        "printed": "-" if voxels is None else PRINTED.get(voxels, BELOW),
    }  # fmt: skip


def _cells(row: dict[str, Any]) -> list[str]:
    mm, looks = row["surface_mm"], np.array(row["looks"])
    return [
        row["sigma_d"], f"{mm[0]:.2f}", f"{np.interp(150, looks, mm):.2f}", f"{mm[-1]:.2f}", str(row["settled"]),
        f"{row['max_mm']:.2f}", f"{row['max_deg']:.2f}", str(row["not_ok"]),
        "-" if row["lost_at"] is None else str(row["lost_at"]), row["printed"],
    ]  # fmt: skip


def _plot(path: Any, rows: list[dict[str, Any]]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, ax = figure(size=(8.0, 4.8))
    for color, row in zip(COLORS, rows, strict=True):
        width = 2.0 if row["sigma_d"] == OURS else 1.2
        ax.plot(row["looks"], row["surface_mm"], label=row["sigma_d"], color=color, linewidth=width)
    ax.axhline(6.0, color="0.6", linestyle=":", linewidth=0.9, label="printed at the start")
    ax.axvline(150, color="0.6", linestyle="--", linewidth=0.9, label="printed: settled")
    ax.set(xlabel="frame", ylabel="mean distance to the true surface (mm)", ylim=(0, 14))
    ax.legend(fontsize=8, ncols=2)
    save_figure(fig, path)
