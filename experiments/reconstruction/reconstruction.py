# SPDX-License-Identifier: MIT
"""Unknown objects reconstructed while they are tracked, from the mask of the first frame: poses, shape, time.

    python -m sdftrack.eval.reconstruction --meshes DIR --refine --tsdf --cache DIR

Rendered frames before a wall, 0.7 m away: "turntable", one full turn seen from 29 degrees above, and "hand", a random
walk of 2 mm and 2 degrees a frame. Errors of the poses are relative to the first frame, at the object's middle. Of the
shape only the part is judged that the frames have shown (sdftrack.eval.seen_part). "settled" is the frame from which on
the mean error of the part seen so far stays within 0.1 mm of its last value; "peak_MB" the memory of the whole process
while a frame is worked on, "own_MB" how much of it came since before the first one, "cpu_ms" the time that all threads
together have worked on a frame. Rows marked "refined" are those after refine(), rows "fusion" those of Open3D's fusion
with the true poses.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence as Seq
from typing import Any

import numpy as np

from experiments.reconstruction.fusion import fused, open3d
from sdftrack.evaluation.tracked_scene import arguments, load_sdf, write_rows
from sdftrack.reproduce.measures.rebuilt import Live, rebuild, relative_errors, settled_at
from sdftrack.evaluation.pose_errors import parse_settings
from sdftrack.reproduce.measures.seen_part import Compared, Truth, compare
from experiments.several.several import noise_of
from sdftrack.evaluation.tables import text_table
from sdftrack.geometry import inverse

__all__ = ["HEAD", "PATHS", "cells", "main", "run_case"]

MESHES = ("lm_cat", "lm_duck", "lm_can", "lm_driller", "spot")
PATHS = ("turntable", "hand")
DISTANCE_M, SEED = 0.7, 1
TRUTH_VOXELS = 240
HEAD = [
    *(
        "case",
        "mean_mm",
        "max_mm",
        "end_mm",
        "mean_deg",
        "max_deg",
        "end_deg",
        "not_ok",
        "chamfer_mm",
        "to_truth",
    ),
    *(
        "to_rebuilt",
        "offset",
        "complete_%",
        "seen_%",
        "settled",
        "ms",
        "cpu_ms",
        "first_ms",
        "peak_MB",
        "own_MB",
    ),
]


def path_of(name: str) -> Any:
    """A trajectory by name."""
    from sdftrack.synth.trajectories import orbit, random_walk

    if name == "turntable":
        return orbit(distance_m=DISTANCE_M, turns=1.0, elevation_rad=0.5)
    return random_walk(step_m=0.002, step_rad=float(np.radians(2.0)), distance_m=DISTANCE_M)


def run_case(name: str, path: str, noise: str, a: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Rows of one object, path and noise: live, and as asked for refined and fusion."""
    import sdftrack as st

    mesh = st.Mesh.load(a.meshes / f"{name}.ply")
    seq = st.synth.sequence(
        mesh, a.frames, path_of(path), noise_of(noise, a.sigma), seed=SEED, clutter="wall",
        threads=a.threads, cache=a.cache,
    )  # fmt: skip
    poses = np.array([seq.ground_truth[i][0] for i in range(a.frames)])
    truth = Truth.of(mesh, load_sdf(mesh, name, TRUTH_VOXELS, a.cache), seq.camera, poses)
    star = st.Reconstructor(
        seq.camera, voxels=a.voxels, mode=a.mode, threads=a.threads, **parse_settings(a.set)
    )
    live = rebuild(star, seq, truth, a.frames)
    own_true = inverse(live.poses[0]) @ poses[0]
    middle = mesh.bounds.mean(axis=0)
    key = f"{name} {path} {noise}"
    rows = {key: live_row(live, poses, middle) | shape_row(compare(_in_truth(star, own_true), truth))}
    if a.refine:
        begin = time.perf_counter()
        refined = star.refine()
        seconds = time.perf_counter() - begin
        # Frames that were not kept have no refined pose; the first always has one.
        kept = sorted(refined.poses)
        found = np.array([refined.poses[i] for i in kept])
        rows[f"{key}, refined"] = (
            pose_row(found, poses[kept], middle)
            | shape_row(compare(_in_truth(star, inverse(found[0]) @ poses[0]), truth))
            | {"seconds": seconds, "kept": len(kept)}
        )
    if a.tsdf:
        plain = fused(seq, a.frames, poses, star.shape.voxel_size)
        rows[f"{key}, fusion"] = shape_row(compare(plain, truth))
    return rows


def _in_truth(star: Any, own_true: Any) -> Any:
    return star.mesh().transformed(inverse(own_true))


def pose_row(found: Any, truth: Any, middle: Any) -> dict[str, Any]:
    """Numbers of the poses, mm and degrees."""
    e = relative_errors(found, truth, middle)
    mm, deg = 1e3 * e.metres, np.rad2deg(e.radians)
    return {
        "mean_mm": float(mm.mean()), "max_mm": float(mm.max()), "end_mm": float(mm[-1]),
        "mean_deg": float(deg.mean()), "max_deg": float(deg.max()), "end_deg": float(deg[-1]),
        "all_mm": np.round(mm, 4).tolist(), "all_deg": np.round(deg, 4).tolist(),
        "poses": np.round(found[:, :3], 6).tolist(),
    }  # fmt: skip


def live_row(live: Live, truth: Any, middle: Any) -> dict[str, Any]:
    """Numbers of the poses, of time and of memory."""
    return pose_row(live.poses, truth, middle) | {
        "not_ok": sum(s != "ok" for s in live.status),
        "settled": settled_at(live.looks, live.surface_m),
        "surface_mm": np.round(1e3 * live.surface_m, 4).tolist(),
        "ms": 1e3 * float(np.median(live.seconds[1:])),
        "cpu_ms": 1e3 * float(np.median(live.cpu_seconds[1:])),
        "first_ms": 1e3 * float(live.seconds[0]),
        "peak_MB": live.peak_mb,
        "own_MB": live.peak_mb - live.before_mb,
    }


def shape_row(c: Compared) -> dict[str, Any]:
    """Numbers of the shape, mm and percent."""
    return {
        "chamfer_mm": 1e3 * c.chamfer_m, "to_truth": 1e3 * c.to_truth_m, "to_rebuilt": 1e3 * c.to_rebuilt_m,
        "offset": 1e3 * c.offset_m, "complete_%": 100 * c.complete, "seen_%": 100 * c.seen_share,
    }  # fmt: skip


def cells(name: str, row: dict[str, Any]) -> list[str]:
    """A row as text, "-" where it has no such number."""
    whole = ("not_ok", "settled", "first_ms", "peak_MB", "own_MB", "seen_%")
    return [name] + [
        "-" if key not in row else f"{row[key]:.0f}" if key in whole
        else f"{row[key]:.1f}" if key in ("ms", "cpu_ms", "complete_%") else f"{row[key]:.2f}"
        for key in HEAD[1:]
    ]  # fmt: skip


def _parser() -> argparse.ArgumentParser:
    p = arguments("sdftrack.eval.reconstruction", __doc__, frames=300, seeds=1)
    p.add_argument("--names", dest="only", help="the same as --only")
    p.add_argument("--paths", default=",".join(PATHS), help="comma separated")
    p.add_argument(
        "--noise", default="1mm,kinect", help='"kinect" or millimetres as in "1mm", comma separated'
    )
    p.add_argument("--refine", action="store_true", help="also the poses and the shape after refine()")
    p.add_argument("--tsdf", action="store_true", help="also Open3D's fusion with the true poses")
    p.set_defaults(mode="rgbd", only=",".join(MESHES))
    for action in p._actions:
        if action.dest == "mode":
            action.choices, action.help = ["depth", "rgbd", "auto"], "what the poses are tracked by"
        elif action.dest == "set":
            action.help = "of the reconstructor"
    return p


def main(given: Seq[str] | None = None) -> int:
    """Run all cases and print their table."""
    p = _parser()
    a = p.parse_args(given)
    paths = a.paths.split(",")
    if unknown := [x for x in paths if x not in PATHS]:
        p.error(f"--paths: expected some of {', '.join(PATHS)}, got {unknown[0]!r}")
    if a.tsdf:
        open3d()  # missing: said before the first case, not after it
    rows: dict[str, Any] = {}
    for noise in a.noise.split(","):
        for path in paths:
            for name in a.only.split(","):
                for key, row in run_case(name, path, noise, a).items():
                    rows[key] = row
                    print("# " + "  ".join(cells(key, row)), file=sys.stderr, flush=True)
                    write_rows(a.json, a, rows)
    title = f"{a.frames} frames, {a.voxels} voxels, {a.mode}; mm, degrees, ms, MiB"
    print(text_table(title, HEAD, [cells(k, r) for k, r in rows.items()]))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
