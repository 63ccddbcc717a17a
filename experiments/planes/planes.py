# SPDX-License-Identifier: MIT
"""Tables taken out of labelled scenes, and the angles of a synthetic corner."""

from __future__ import annotations

import time
from collections.abc import Iterable
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.data import has
from experiments.planes.table_scenes import open_scenes, through
from experiments.registry import experiment
from experiments.synth.room import corner
from experiments.synth.table_scene import TableScene
from experiments.table import Table

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TOLERANCE_M, STANDS_OUT_M = 0.01, 0.010
MIN_TABLE, MAX_HIGH = 98.0, 1.0  # wanted, %
TIMED = 9  # calls, the median of which is printed
NOISES: dict[str, Any] = {"none": None, "1 mm": 0.001, "3 mm": 0.003, "kinect": "kinect"}
METHODS = ("rigid", "bent", "printed", "ransac")


def ransac(
    depth: Any, camera: Any, tolerance_m: float = TOLERANCE_M, tries: int = 200, seed: int = 0
) -> tuple[Mask, tuple[Array, float]]:
    """What a few lines of numpy do: triples of 5,000 readings, the most votes, one refit, a constant tolerance."""
    rng = np.random.default_rng(seed)
    all_points = camera.back_project(depth)
    points = all_points[depth > 0]
    points = points[rng.choice(len(points), min(5000, len(points)), replace=False)]
    best, most = np.zeros(len(points), bool), 0
    for _ in range(tries):
        a, b, c = points[rng.choice(len(points), 3, replace=False)]
        n = np.cross(b - a, c - a)
        if not np.linalg.norm(n) > 0:
            continue
        near = np.abs((points - a) @ (n / np.linalg.norm(n))) < tolerance_m
        if near.sum() > most:
            best, most = near, int(near.sum())
    n, d = through(points[best])
    return (depth > 0) & (np.abs(all_points @ n + d) > tolerance_m), (n, d)


def removed(scene: TableScene, off_plane: Mask) -> dict[str, float]:
    """Shares (%) that are not in the mask: of the table, of object points that stand out, of all object points."""
    high = scene.objects & (scene.height_m > STANDS_OUT_M)
    return {
        name: 100 * float((~off_plane[where]).mean())
        for name, where in (("table", scene.table), ("high", high), ("objects", scene.objects))
    }


def scene_row(
    scene: TableScene, method: str, start_px: tuple[int, int] | None = None, calls: int = TIMED
) -> tuple[dict[str, float], Mask]:
    """Shares, the normal's angle to the labelled table's (deg), the median time of a call (ms); and what is left."""
    n_true = through(scene.camera.back_project(scene.frame.depth)[scene.table])[0]
    mask, seconds = np.ones(scene.table.shape, bool), []
    for _ in range(calls):
        start = time.perf_counter()
        try:
            if method == "ransac":
                mask, (n, _) = ransac(scene.frame.depth, scene.camera)
            else:
                mask, (n, _) = st.remove_plane(
                    scene.frame, scene.camera, start_px, tolerance=TOLERANCE_M, method=method
                )
        except ValueError:
            return dict.fromkeys(("table", "high", "objects", "deg", "ms"), float("nan")), mask
        seconds.append(time.perf_counter() - start)
    deg = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(n, n_true)), n @ n_true)))
    return {**removed(scene, mask), "deg": deg, "ms": 1e3 * float(np.median(seconds))}, mask


def angle_errors(corners: Iterable[Any], camera: Any) -> Array:
    """(count, 3) deviations from 90 degrees of the planes of corners, as a camera back-projects them."""
    return np.array([st.metrics.plane_angles(frame, camera) - 90 for frame in corners])


def _scene_tables(folder: Path, count: int | None) -> list[Table]:
    scenes = open_scenes(folder)[:count]
    rows: dict[str, Any] = {
        m: {s.name: scene_row(s, m, calls=3 if m == "ransac" else TIMED)[0] for s in scenes} for m in METHODS
    }
    columns = ("table", "high", "objects")
    cells = [
        [s.name, *(" / ".join(f"{rows[m][s.name][c]:.2f}" for c in columns) for m in METHODS)] for s in scenes
    ]
    title = (
        f"Shares taken out, %: of the table (wanted >= {MIN_TABLE:g}), of object points more than "
        f"{1e3 * STANDS_OUT_M:g} mm above it (<= {MAX_HIGH:g}), of all object points"
    )
    worst = [[m, *_worst(list(rows[m].values()))] for m in METHODS]
    head = [
        "way", "table least", "high most", "objects mean", "objects most", "normal deg most", "ms median", "kept",
    ]  # fmt: skip
    return [
        Table(title, ["scene", *METHODS], cells, numbers=rows),
        Table(f"Over {len(scenes)} scenes", head, worst),
    ]


def _worst(rows: Seq[dict[str, float]]) -> list[str]:
    v = {k: np.array([r[k] for r in rows]) for k in rows[0]}
    kept = bool((v["table"] >= MIN_TABLE).all() and (v["high"] <= MAX_HIGH).all())
    numbers = (
        v["table"].min(), v["high"].max(), v["objects"].mean(), v["objects"].max(), v["deg"].max(), np.median(v["ms"]),
    )  # fmt: skip
    return [*(f"{x:.2f}" for x in numbers), "yes" if kept else "no"]


def _corner_table(count: int) -> Table:
    start = st.Camera(600.0, 600.0, 300.0, 200.0, 640, 480)  # the thesis's first guess
    cases = [(name, None) for name in NOISES] + [("kinect", start)]
    rows, cells = {}, []
    for name, judged in cases:
        seq = corner(count, NOISES[name], 0)
        off = angle_errors(seq, judged or seq.camera)
        total = np.abs(off).sum(axis=1)
        label = f"{name}, {'600 600 300 200' if judged else 'true intrinsics'}"
        rows[label] = {
            "angle_rms_deg": float(np.sqrt(np.mean(off**2))), "angle_most_deg": float(np.abs(off).max()),
            "sum_mean_deg": float(total.mean()), "sum_most_deg": float(total.max()),
        }  # fmt: skip
        cells.append([label, *(f"{x:.4f}" for x in rows[label].values())])
    title = f"Three planes of a corner, {count} poses: deviations of the angles from 90 deg, and their sum"
    return Table(title, ["noise", "angle rms", "angle most", "sum mean", "sum most"], cells, numbers=rows)


@experiment(
    "planes",
    uses=["osd"],
    chosen_on="the scenes of osd",
    reported_on="the same scenes of osd; the corners are synthetic and nothing was chosen on them",
    short={"scenes": 1, "corners": 2},
)
def planes(*, data: Path, scenes: int | None = None, corners: int = 50) -> list[Table]:
    """Tables taken out of recorded scenes, and three planes of a synthetic corner against their right angles.

    For each scene: which share (%) of the labelled table is taken out, of the object points that stand more than 10 mm
    above it, and of all object points; for the default, for the bent plane, for the thesis's way (a patch extended as
    it is) and for plain RANSAC with a constant tolerance in numpy. Then what the angles between the planes of a corner
    deviate from 90 degrees, given the true intrinsics: the floor of the thesis's Table 3.1.

    Parameters
    ----------
    scenes
        the first so many; none: all
    corners
        poses of the corner; 0: none
    """
    tables = _scene_tables(data / "osd", scenes) if has("osd", data) else []
    return tables + ([_corner_table(corners)] if corners else [])
