# SPDX-License-Identifier: MIT
"""Depth tracking of rendered meshes against the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.protocol import MESHES, load_mesh, load_sdf, say
from experiments.common.tracked_scene import WRONG_M, WRONG_RAD
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table
from experiments.thesis.scenes.truth import Truth, default_camera, motion, noisy, render_truth
from sdftrack.evaluation.pose_errors import pose_errors, track_frames

__all__ = ["MESHES", "cells", "run_mesh", "synthetic"]

Array = NDArray[np.float64]


def run_mesh(
    sdf: Any,
    truths: Seq[Truth],
    sigma_m: float,
    options: dict[str, Any] | None = None,
    axis: Array | None = None,
) -> dict[str, Any]:
    """Track every truth sequence once with its own noise; a row of the table as plain numbers (mm, deg)."""
    import sdftrack as st

    errors, statuses, seconds, ratios = [], [], [], []
    for seed, truth in enumerate(truths):
        rng = np.random.default_rng([seed, round(1e6 * sigma_m)])
        tracker = st.Tracker(sdf, truth.camera, mode="depth", **(options or {}))
        frames = (
            st.Frame(noisy(truth.depth(i), sigma_m, rng), timestamp=i / 30.0, index=i)
            for i in range(len(truth))
        )
        results = track_frames(tracker, frames, [truth.poses[0]])
        errors.append(pose_errors(np.array([r.poses[0] for r in results]), truth.poses, axis))
        statuses += [str(r.status[0]) for r in results]
        seconds += [r.seconds for r in results[1:]]
        ratios.append((sigma_m * truth.bound_m, sigma_m * truth.bound_rad))
    t = np.concatenate([e.translation_m for e in errors])
    r = np.concatenate([e.rotation_rad for e in errors])
    turn = np.concatenate([e.turn_rad for e in errors])
    offset = np.concatenate([e.offset_m for e in errors])
    bound_t = float(np.mean(np.concatenate([a for a, _ in ratios])))
    bound_r = float(np.mean(np.concatenate([b for _, b in ratios])))
    return {
        "sigma_mm": 1e3 * sigma_m,
        "frames": len(t),
        "pixels": float(np.mean(np.concatenate([truth.pixels for truth in truths]))),
        "mean_mm": 1e3 * float(t.mean()),
        "max_mm": 1e3 * float(t.max()),
        "mean_deg": float(np.rad2deg(r.mean())),
        "max_deg": float(np.rad2deg(r.max())),
        "bound_mm": 1e3 * bound_t,
        "bound_deg": float(np.rad2deg(bound_r)),
        "times_bound_mm": float(t.mean()) / bound_t if bound_t > 0 else float("nan"),
        "times_bound_deg": float(r.mean()) / bound_r if bound_r > 0 else float("nan"),
        "bias_mm": (1e3 * offset.mean(axis=0)).tolist(),
        "turn_max_deg": float(np.rad2deg(turn.max())) if axis is not None else None,
        "lost": int(sum(s in ("lost", "bad_frame") for s in statuses)),
        "weak": int(sum(s == "weak" for s in statuses)),
        "wrong": int(np.sum((t > WRONG_M) | (r > WRONG_RAD))),
        "ms_per_frame": 1e3 * float(np.median(seconds)) if seconds else float("nan"),
    }


COLUMNS = (
    "mesh", "sigma mm", "mean mm", "max mm", "mean deg", "max deg", "bound mm", "bound deg", "x bound mm",
    "x bound deg", "bias x mm", "bias y mm", "bias z mm", "lost", "weak", "wrong", "px", "ms",
)  # fmt: skip


def cells(name: str, q: dict[str, Any]) -> list[str]:
    """A row of the table."""
    return [
        name, f"{q['sigma_mm']:.2f}", f"{q['mean_mm']:.4f}", f"{q['max_mm']:.3f}", f"{q['mean_deg']:.4f}",
        f"{q['max_deg']:.3f}", f"{q['bound_mm']:.4f}", f"{q['bound_deg']:.4f}", f"{q['times_bound_mm']:.2f}",
        f"{q['times_bound_deg']:.2f}", *(f"{b:+.3f}" for b in q["bias_mm"]), str(q["lost"]), str(q["weak"]),
        str(q["wrong"]), f"{q['pixels']:.0f}", f"{q['ms_per_frame']:.2f}",
    ]  # fmt: skip


@experiment(
    "synthetic",
    needs=["meshes"],
    chosen_on="the same four meshes, other seeds and shorter paths",
    reported_on="lm_driller, lm_can, lm_cat, spot; seeds 0 to 2",
    short={"only": ("spot",), "seeds": 1, "frames": 15, "voxels": 80},
)
def synthetic(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    sigma: tuple[float, ...] = (0.001,),
    seeds: int = 3,
    frames: int = 300,
    step_mm: float = 5.0,
    step_deg: float = 1.5,
    voxels: int = 200,
    threads: int = 0,
    axis: Settings = NO_SETTINGS,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
    bound_only: bool = False,
) -> Table:
    """Depth tracking of rendered meshes against the Cramer-Rao bound.

    Errors over all frames and seeds, their multiple of the bound, the bias along the camera's axes, and the frames
    that were called lost.

    Parameters
    ----------
    sigma
        depth noise, m; several, comma separated
    axis
        axis of symmetry of a mesh, NAME=x,y,z
    bound_only
        the bound alone: needs no tracker
    """
    axes = {k: np.array(v, np.float64) for k, v in axis.items()}
    camera = default_camera()
    rows: dict[str, dict[str, Any]] = {}
    bounds: list[list[str]] = []
    for name in only:
        mesh = load_mesh(data, name)
        centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
        truths = [
            render_truth(
                mesh,
                motion(frames, 1e-3 * step_mm, np.deg2rad(step_deg), seed, centre),
                camera,
                threads,
                cache,
            )
            for seed in range(seeds)
        ]
        if bound_only:
            m, rad = np.mean([[t.bound_m.mean(), t.bound_rad.mean()] for t in truths], axis=0)
            pixels = np.mean([t.pixels.mean() for t in truths])
            bounds += [
                [name, f"{1e3 * s:.2f}", f"{1e3 * s * m:.4f}", f"{np.rad2deg(s * rad):.4f}", f"{pixels:.0f}"]
                for s in sigma
            ]
            continue
        sdf = load_sdf(mesh, name, voxels, cache)
        for s in sigma:
            key = name if len(sigma) == 1 else f"{name}@{1e3 * s:g}"
            rows[key] = run_mesh(sdf, truths, s, {"threads": threads, **options}, axes.get(name))
            say("  ".join(cells(key, rows[key])))
    title = f"{frames} frames, {step_mm:g} mm and {step_deg:g} deg per frame, {seeds} seeds"
    if bound_only:
        return Table(title, ["mesh", "sigma mm", "bound mm", "bound deg", "px"], bounds)
    turns = [
        f"{name}: turn about the axis, excepted above: at most {q['turn_max_deg']:.2f} deg"
        for name, q in rows.items()
        if q["turn_max_deg"] is not None
    ]
    return Table(title, COLUMNS, [cells(name, q) for name, q in rows.items()], turns, rows)
