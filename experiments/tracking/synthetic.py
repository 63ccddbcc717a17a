# SPDX-License-Identifier: MIT
"""Depth tracking of rendered meshes against the Cramer-Rao bound.

    python -m sdftrack.eval.synthetic --meshes DIR --sigma 0.001 --seeds 3 --step-mm 5 --step-deg 1.5 --frames
    300

One row per mesh: mean and largest errors over all frames and seeds, their multiple of the bound, the bias
along the camera's axes, and the frames that were called lost.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.evaluation.tracked_scene import ASTRAY_M, ASTRAY_RAD, MESHES, load_sdf, settings_of, write_rows
from sdftrack.evaluation.pose_errors import parse_settings, pose_errors, track_frames
from sdftrack.reproduce.scenes.truth import Truth, default_camera, motion, noisy, render_truth

__all__ = ["MESHES", "main", "run_mesh"]

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
        "astray": int(np.sum((t > ASTRAY_M) | (r > ASTRAY_RAD))),
        "ms_per_frame": 1e3 * float(np.median(seconds)) if seconds else float("nan"),
    }


def format_rows(rows: dict[str, dict[str, Any]]) -> str:
    """The table that is printed."""
    head = (
        f"{'mesh':12s} {'sigma':>6s} {'mean mm':>8s} {'max':>7s} {'mean deg':>8s} {'max':>7s} "
        f"{'bound mm':>8s} {'deg':>7s} {'x bound':>13s} {'bias x y z mm':>22s} "
        f"{'lost':>4s} {'weak':>4s} {'astray':>6s} {'px':>6s} {'ms':>6s}"
    )
    lines = [head]
    for name, q in rows.items():
        bias = " ".join(f"{b:+.3f}" for b in q["bias_mm"])
        lines.append(
            f"{name:12s} {q['sigma_mm']:6.2f} {q['mean_mm']:8.4f} {q['max_mm']:7.3f} {q['mean_deg']:8.4f} "
            f"{q['max_deg']:7.3f} {q['bound_mm']:8.4f} {q['bound_deg']:7.4f} "
            f"{q['times_bound_mm']:6.2f} {q['times_bound_deg']:6.2f} {bias:>22s} "
            f"{q['lost']:4d} {q['weak']:4d} {q['astray']:6d} {q['pixels']:6.0f} {q['ms_per_frame']:6.2f}"
        )
        if q["turn_max_deg"] is not None:
            lines.append(f"{'':12s} turn about the axis, excepted above: at most {q['turn_max_deg']:.2f} deg")
    return "\n".join(lines)


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.synthetic", description=(__doc__ or "").split("\n")[0]
    )
    p.add_argument("--meshes", type=Path, required=True, help="folder with NAME.ply, metres")
    p.add_argument("--only", default=",".join(MESHES), help="names, comma separated")
    p.add_argument("--sigma", default="0.001", help="depth noise, m; several comma separated")
    p.add_argument("--seeds", type=int, default=3)
    p.add_argument("--frames", type=int, default=300)
    p.add_argument("--step-mm", type=float, default=5.0)
    p.add_argument("--step-deg", type=float, default=1.5)
    p.add_argument("--voxels", type=int, default=200)
    p.add_argument("--threads", type=int, default=0)
    p.add_argument(
        "--axis", action="append", default=[], metavar="NAME=x,y,z", help="axis of symmetry of a mesh"
    )
    p.add_argument(
        "--set", action="append", default=[], metavar="OPTION=VALUE", help="an option of the tracker"
    )
    p.add_argument("--cache", type=Path, help="folder that keeps volumes and noise-free images between runs")
    p.add_argument("--bound-only", action="store_true", help="print the bound alone: needs no tracker")
    p.add_argument("--json", type=Path)
    return p


def main(arguments: Seq[str] | None = None) -> int:
    """Run the protocol and print the table."""
    import sdftrack as st

    a = _parser().parse_args(arguments)
    axes = {k: np.array(v, np.float64) for k, v in parse_settings(a.axis).items()}
    camera = default_camera()
    rows: dict[str, dict[str, Any]] = {}
    for name in [n for n in a.only.split(",") if n]:
        began = time.perf_counter()
        mesh = st.Mesh.load(a.meshes / f"{name}.ply")
        centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
        truths = [
            render_truth(
                mesh,
                motion(a.frames, 1e-3 * a.step_mm, np.deg2rad(a.step_deg), seed, centre),
                camera,
                a.threads,
                a.cache,
            )
            for seed in range(a.seeds)
        ]
        if a.bound_only:
            bounds = np.mean([[t.bound_m.mean(), t.bound_rad.mean()] for t in truths], axis=0)
            for sigma in map(float, a.sigma.split(",")):
                print(
                    f"{name:12s} sigma {1e3 * sigma:.2f} mm: bound {1e3 * sigma * bounds[0]:.4f} mm "
                    f"{np.rad2deg(sigma * bounds[1]):.4f} deg, "
                    f"{np.mean([t.pixels.mean() for t in truths]):.0f} px",
                    flush=True,
                )
            continue
        sdf = load_sdf(mesh, name, a.voxels, a.cache)
        print(f"# {name}: prepared in {time.perf_counter() - began:.1f} s", file=sys.stderr, flush=True)
        options = settings_of(a)
        for sigma in map(float, a.sigma.split(",")):
            row = run_mesh(sdf, truths, sigma, options, axes.get(name))
            rows[name if "," not in a.sigma else f"{name}@{1e3 * sigma:g}"] = row
            print(format_rows({name: row}).split("\n", 1)[1], file=sys.stderr, flush=True)
    if rows:
        print(f"{a.frames} frames, {a.step_mm:g} mm and {a.step_deg:g} deg per frame, {a.seeds} seeds")
        print(format_rows(rows))
    write_rows(a.json, a, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
