# SPDX-License-Identifier: MIT
"""RGB-D tracking beside depth alone, on the same rendered frames."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from experiments.common.protocol import MESHES, load_mesh, load_sdf, say
from experiments.common.tracked_scene import WRONG_M, WRONG_RAD
from experiments.common.truth import default_camera, motion, render_truth
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.evaluation.pose_errors import pose_errors

__all__ = ["WAYS", "cells", "follow", "rgbd", "summary"]

Array = NDArray[np.float64]
WAYS: dict[str, dict[str, Any]] = {
    "depth": {"mode": "depth"},
    "odds": {"mode": "rgbd", "color_likelihood": "odds"},
    "printed": {"mode": "rgbd", "color_likelihood": "printed"},
}


def follow(sdf: Any, frames: Any, camera: Any, T_start: Array, ways: Mapping[str, dict[str, Any]]) -> Any:
    """Track the same frames in several ways at once: {way: [result of every frame]}."""
    import sdftrack as st

    trackers = {way: st.Tracker(sdf, camera, **settings) for way, settings in ways.items()}
    results: dict[str, list[Any]] = {way: [] for way in ways}
    for i, frame in enumerate(frames):
        for way, tracker in trackers.items():
            results[way].append(tracker.track(frame) if i else tracker.start(frame, poses=[T_start]))
    return results


def summary(results: Seq[Any], truth: Array) -> dict[str, Any]:
    """Errors of one run, mm and deg: the numbers of a row. The first frame is one of them."""
    errors = pose_errors(np.array([r.poses[0] for r in results]), truth)
    t, r = errors.translation_m, errors.rotation_rad
    status = [str(x.status[0]) for x in results]
    return {
        "frames": len(t),
        "mean_mm": 1e3 * float(t.mean()),
        "max_mm": 1e3 * float(t.max()),
        "mean_deg": float(np.rad2deg(r.mean())),
        "max_deg": float(np.rad2deg(r.max())),
        "bias_mm": (1e3 * errors.offset_m.mean(axis=0)).tolist(),
        "lost": sum(s in ("lost", "bad_frame") for s in status),
        "weak": sum(s == "weak" for s in status),
        "wrong": int(np.sum((t > WRONG_M) | (r > WRONG_RAD))),
        "ms_per_frame": 1e3 * float(np.median([x.seconds for x in results[1:]])) if len(results) > 1 else 0.0,
    }


def joined(rows: Seq[dict[str, Any]]) -> dict[str, Any]:
    """Rows of several seeds as one: means of means, largest of the largest, sums of counts."""
    out: dict[str, Any] = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        if name in ("lost", "weak", "wrong", "frames"):
            out[name] = sum(values)
        else:
            out[name] = np.max(values) if name.startswith("max") else np.mean(values, axis=0).tolist()
    return out


def run_mesh(
    mesh: Any,
    sdf: Any,
    sigma_m: float,
    ways: Mapping[str, dict[str, Any]],
    frames: int,
    seeds: int,
    step: tuple[float, float] = (0.005, float(np.deg2rad(1.5))),
    cache: Path | None = None,
    threads: int = 0,
) -> dict[str, dict[str, Any]]:
    """One mesh before clutter, no occluder: a row per way."""
    from sdftrack import synth

    camera = default_camera()
    centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    found: dict[str, list[dict[str, Any]]] = {way: [] for way in ways}
    bounds = []
    for seed in range(seeds):
        poses = motion(frames, step[0], step[1], seed, centre)
        truth = render_truth(mesh, poses, camera, threads, cache)
        bounds.append((truth.bound_m.mean(), truth.bound_rad.mean()))
        scene = synth.sequence(
            mesh, frames, poses, sigma_m, seed=seed, camera=camera, clutter="objects", threads=threads
        )
        results = follow(sdf, scene, camera, poses[0], ways)
        for way in ways:
            found[way].append(summary(results[way], poses))
    rows = {way: joined(found[way]) for way in ways}
    bound_mm, bound_deg = 1e3 * sigma_m * np.mean(bounds, axis=0) * [1, 1e-3 * 180 / np.pi]
    depth = rows.get("depth")
    for row in rows.values():
        row["times_bound"] = (row["mean_mm"] / bound_mm, row["mean_deg"] / bound_deg)
        row["times_depth"] = (
            (row["mean_mm"] / depth["mean_mm"], row["mean_deg"] / depth["mean_deg"])
            if depth
            else (np.nan, np.nan)
        )
    return rows


COLUMNS = (
    "mesh, sigma mm, way", "mean mm", "max mm", "mean deg", "max deg", "x bound mm", "x bound deg", "x depth mm",
    "x depth deg", "lost", "weak", "wrong", "ms",
)  # fmt: skip


def cells(name: str, q: dict[str, Any]) -> list[str]:
    """A row of the table."""
    return [
        name, f"{q['mean_mm']:.4f}", f"{q['max_mm']:.3f}", f"{q['mean_deg']:.4f}", f"{q['max_deg']:.3f}",
        *(f"{x:.2f}" for x in q["times_bound"]), *(f"{x:.3f}" for x in q["times_depth"]), str(q["lost"]),
        str(q["weak"]), str(q["wrong"]), f"{q['ms_per_frame']:.2f}",
    ]  # fmt: skip


@experiment(
    "rgbd",
    needs=["meshes"],
    chosen_on="the same four meshes and the hand of `occlusion`",
    reported_on="lm_driller, lm_can, lm_cat, spot before clutter; seed 0",
    short={"only": ("spot",), "frames": 5, "voxels": 80},
)
def rgbd(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    ways: tuple[Literal["depth", "odds", "printed"], ...] = ("depth", "odds", "printed"),
    sigma: tuple[float, ...] = (0.001,),
    seeds: int = 1,
    frames: int = 300,
    step_mm: float = 5.0,
    step_deg: float = 1.5,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """RGB-D tracking beside depth alone, on the same rendered frames, against the depth-only bound.

    The objects and paths of `synthetic` before a wall, a table and ten things of random colours, with the meshes' own
    colours. The way "depth" uses no colours, "odds" and "printed" are the two likelihoods (docs/math/color.md).

    Parameters
    ----------
    ways
        of using the colours, comma separated
    sigma
        depth noise, m; several, comma separated
    """
    chosen: dict[str, dict[str, Any]] = {way: {**WAYS[way], "threads": threads, **options} for way in ways}
    rows: dict[str, dict[str, Any]] = {}
    for name in only:
        mesh = load_mesh(data, name)
        sdf = load_sdf(mesh, name, voxels, cache)
        for s in sigma:
            step = 1e-3 * step_mm, float(np.deg2rad(step_deg))
            found = run_mesh(mesh, sdf, s, chosen, frames, seeds, step, cache, threads)
            mine = {f"{name} {1e3 * s:.2f} {way}": row for way, row in found.items()}
            for key, row in mine.items():
                say("  ".join(cells(key, row)))
            rows.update(mine)
    title = f"{frames} frames, {step_mm:g} mm and {step_deg:g} deg per frame, {seeds} seeds, clutter"
    return Table(title, COLUMNS, [cells(name, row) for name, row in rows.items()], numbers=rows)
