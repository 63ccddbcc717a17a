# SPDX-License-Identifier: MIT
"""Depth tracking of rendered meshes against the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as Seq
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.pose_errors import Errors, pose_errors, track_frames
from experiments.common.protocol import MESHES, load_mesh, load_sdf, say
from experiments.common.tracked_scene import WRONG_M, WRONG_RAD
from experiments.common.truth import Truth, default_camera, motion, noisy, render_truth
from experiments.options import NO_SETTINGS, Settings
from experiments.progress import step
from experiments.registry import experiment
from experiments.table import Table, cells

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Followed:
    """A sequence tracked with its own noise."""

    truth: Truth
    sigma_m: float
    poses: Array
    errors: Errors
    status: list[str]
    seconds: list[float]


def follow(
    sdf: Any,
    truth: Truth,
    sigma_m: float,
    seed: int = 0,
    options: Mapping[str, Any] = NO_SETTINGS,
    axis: Array | None = None,
) -> Followed:
    """Track a truth sequence by depth alone, from its first pose."""
    import sdftrack as st

    rng = np.random.default_rng([seed, round(1e6 * sigma_m)])
    tracker = st.Tracker(sdf, truth.camera, mode="depth", **options)
    frames = (
        st.Frame(noisy(truth.depth(i), sigma_m, rng), timestamp=i / 30.0, index=i) for i in range(len(truth))
    )
    results = track_frames(
        tracker,
        frames,
        [truth.poses[0]],
        lambda i, _: step(i + 1, len(truth), f"sigma {1e3 * sigma_m:.2f} mm"),
    )
    poses = np.array([r.poses[0] for r in results])
    return Followed(
        truth,
        sigma_m,
        poses,
        pose_errors(poses, truth.poses, axis),
        [str(r.status[0]) for r in results],
        [r.seconds for r in results],
    )


def joined(runs: Seq[Followed]) -> dict[str, Any]:
    """A row of the table over runs of one noise, as plain numbers (mm, deg)."""
    t, r, turn, offset = (
        np.concatenate([getattr(run.errors, name) for run in runs])
        for name in ("translation_m", "rotation_rad", "turn_rad", "offset_m")
    )
    bound_t, bound_r = (
        float(np.mean(np.concatenate([run.sigma_m * getattr(run.truth, name) for run in runs])))
        for name in ("bound_m", "bound_rad")
    )
    statuses = [s for run in runs for s in run.status]
    seconds = [s for run in runs for s in run.seconds[1:]]
    return {
        "sigma_mm": 1e3 * runs[0].sigma_m,
        "frames": len(t),
        "pixels": float(np.mean(np.concatenate([run.truth.pixels for run in runs]))),
        "mean_mm": 1e3 * float(t.mean()),
        "max_mm": 1e3 * float(t.max()),
        "mean_deg": float(np.rad2deg(r.mean())),
        "max_deg": float(np.rad2deg(r.max())),
        "bound_mm": 1e3 * bound_t,
        "bound_deg": float(np.rad2deg(bound_r)),
        "times_bound_mm": float(t.mean()) / bound_t if bound_t > 0 else float("nan"),
        "times_bound_deg": float(r.mean()) / bound_r if bound_r > 0 else float("nan"),
        **{f"bias_{axis}_mm": 1e3 * float(offset[:, k].mean()) for k, axis in enumerate("xyz")},
        "turn_max_deg": float(np.rad2deg(turn.max())),
        "lost": int(sum(s in ("lost", "bad_frame") for s in statuses)),
        "weak": int(sum(s == "weak" for s in statuses)),
        "wrong": int(np.sum((t > WRONG_M) | (r > WRONG_RAD))),
        "ms_per_frame": 1e3 * float(np.median(seconds)) if seconds else float("nan"),
    }


COLUMNS = {
    "mesh": "mesh",
    "sigma mm": "sigma_mm:.2f",
    "mean mm": "mean_mm:.4f",
    "max mm": "max_mm:.3f",
    "mean deg": "mean_deg:.4f",
    "max deg": "max_deg:.3f",
    "bound mm": "bound_mm:.4f",
    "bound deg": "bound_deg:.4f",
    "x bound mm": "times_bound_mm:.2f",
    "x bound deg": "times_bound_deg:.2f",
    **{f"bias {axis} mm": f"bias_{axis}_mm:+.3f" for axis in "xyz"},
    "lost": "lost",
    "weak": "weak",
    "wrong": "wrong",
    "px": "pixels:.0f",
    "ms": "ms_per_frame:.2f",
}
BOUNDS = {name: COLUMNS[name] for name in ("mesh", "sigma mm", "bound mm", "bound deg", "px")}


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
    rows: list[dict[str, Any]] = []
    for name in only:
        mesh = load_mesh(data, name)
        truths = paths(mesh, seeds, frames, step_mm, step_deg, threads, cache)
        if bound_only:
            rows += [{"mesh": name, **_bound(truths, s)} for s in sigma]
            continue
        sdf = load_sdf(mesh, name, voxels, cache)
        for s in sigma:
            told = {"threads": threads, **options}
            runs = [follow(sdf, truth, s, k, told, axes.get(name)) for k, truth in enumerate(truths)]
            rows.append({"mesh": name if len(sigma) == 1 else f"{name}@{1e3 * s:g}", **joined(runs)})
            say("  ".join(cells(COLUMNS, rows[-1])))
    title = f"{frames} frames, {step_mm:g} mm and {step_deg:g} deg per frame, {seeds} seeds"
    if bound_only:
        return Table.of(title, BOUNDS, rows)
    turns = [
        f"{row['mesh']}: turn about the axis, excepted above: at most {row['turn_max_deg']:.2f} deg"
        for row in rows
        if row["mesh"].partition("@")[0] in axes
    ]
    return Table.of(title, COLUMNS, rows, notes=turns)


def paths(
    mesh: Any,
    seeds: int,
    frames: int,
    step_mm: float,
    step_deg: float,
    threads: int,
    cache: Path | None = None,
) -> list[Truth]:
    """A mesh on a path for each seed, noise-free."""
    centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    step_m, step_rad = 1e-3 * step_mm, np.deg2rad(step_deg)
    return [
        render_truth(mesh, motion(frames, step_m, step_rad, k, centre), default_camera(), threads, cache)
        for k in range(seeds)
    ]


def _bound(truths: Seq[Truth], sigma_m: float) -> dict[str, Any]:
    m, rad = np.mean([[t.bound_m.mean(), t.bound_rad.mean()] for t in truths], axis=0)
    return {
        "sigma_mm": 1e3 * sigma_m,
        "bound_mm": 1e3 * sigma_m * m,
        "bound_deg": np.rad2deg(sigma_m * rad),
        "pixels": np.mean([t.pixels.mean() for t in truths]),
    }
