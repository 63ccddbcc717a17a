# SPDX-License-Identifier: MIT
"""RGB-D tracking beside depth alone, on the same rendered frames, against the depth-only bound.

    python -m sdftrack.eval.rgbd --meshes DIR --sigma 0.001,0.00316 --frames 300 --seeds 1

The objects of the depth-only tables on their paths (sdftrack.eval.truth), before a wall, a table and ten things
of random colours, with the meshes' own colours. One row per mesh, noise and way of using the colours: "depth"
does not, "odds" and "printed" are the two likelihoods (docs/math/color.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.evaluation.tracked_scene import ASTRAY_M, ASTRAY_RAD, MESHES, load_sdf, settings_of, write_rows
from sdftrack.evaluation.pose_errors import pose_errors
from sdftrack.reproduce.scenes.truth import default_camera, motion, render_truth

__all__ = ["WAYS", "follow", "format_rows", "main", "summary"]

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
        "astray": int(np.sum((t > ASTRAY_M) | (r > ASTRAY_RAD))),
        "ms_per_frame": 1e3 * float(np.median([x.seconds for x in results[1:]])) if len(results) > 1 else 0.0,
    }


def joined(rows: Seq[dict[str, Any]]) -> dict[str, Any]:
    """Rows of several seeds as one: means of means, largest of the largest, sums of counts."""
    out: dict[str, Any] = {}
    for name in rows[0]:
        values = [row[name] for row in rows]
        if name in ("lost", "weak", "astray", "frames"):
            out[name] = sum(values)
        else:
            out[name] = np.max(values) if name.startswith("max") else np.mean(values, axis=0).tolist()
    return out


def format_rows(rows: Mapping[str, dict[str, Any]]) -> str:
    """The table that is printed."""
    lines = [
        f"{'mesh, sigma mm, way':28s} {'mean mm':>8s} {'max':>7s} {'mean deg':>8s} {'max':>7s} {'x bound':>13s} "
        f"{'x depth':>13s} {'lost':>4s} {'weak':>4s} {'astray':>6s} {'ms':>6s}"
    ]
    for name, q in rows.items():
        lines.append(
            f"{name:28s} {q['mean_mm']:8.4f} {q['max_mm']:7.3f} {q['mean_deg']:8.4f} {q['max_deg']:7.3f} "
            f"{q['times_bound'][0]:6.2f} {q['times_bound'][1]:6.2f} "
            f"{q['times_depth'][0]:6.3f} {q['times_depth'][1]:6.3f} "
            f"{q['lost']:4d} {q['weak']:4d} {q['astray']:6d} {q['ms_per_frame']:6.2f}"
        )
    return "\n".join(lines)


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


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.rgbd", description=(__doc__ or "").split("\n")[0]
    )
    p.add_argument("--meshes", type=Path, required=True, help="folder with NAME.ply, metres")
    p.add_argument("--only", default=",".join(MESHES), help="names, comma separated")
    p.add_argument("--ways", default=",".join(WAYS), help="of these, comma separated")
    p.add_argument("--sigma", default="0.001", help="depth noise, m; several comma separated")
    p.add_argument("--seeds", type=int, default=1)
    p.add_argument("--frames", type=int, default=300)
    p.add_argument("--step-mm", type=float, default=5.0)
    p.add_argument("--step-deg", type=float, default=1.5)
    p.add_argument("--voxels", type=int, default=200)
    p.add_argument("--threads", type=int, default=0)
    p.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE", help="of the tracker")
    p.add_argument("--cache", type=Path, help="folder that keeps volumes and bounds between runs")
    p.add_argument("--json", type=Path)
    return p


def main(arguments: Seq[str] | None = None) -> int:
    """Run the protocol and print the table."""
    import sdftrack as st

    a = _parser().parse_args(arguments)
    ways = {way: {**WAYS[way], **settings_of(a)} for way in a.ways.split(",")}
    rows: dict[str, dict[str, Any]] = {}
    for name in a.only.split(","):
        mesh = st.Mesh.load(a.meshes / f"{name}.ply")
        sdf = load_sdf(mesh, name, a.voxels, a.cache)
        for sigma in map(float, a.sigma.split(",")):
            step = 1e-3 * a.step_mm, float(np.deg2rad(a.step_deg))
            found = run_mesh(mesh, sdf, sigma, ways, a.frames, a.seeds, step, a.cache, a.threads)
            mine = {f"{name} {1e3 * sigma:.2f} {way}": row for way, row in found.items()}
            print(format_rows(mine).split("\n", 1)[1], file=sys.stderr, flush=True)
            rows.update(mine)
    print(f"{a.frames} frames, {a.step_mm:g} mm and {a.step_deg:g} deg per frame, {a.seeds} seeds, clutter")
    print(format_rows(rows))
    write_rows(a.json, a, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
