# SPDX-License-Identifier: MIT
"""Unknown objects reconstructed while they are tracked: poses, shape, time."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

import sdftrack as st
from experiments.common.protocol import load_mesh, load_sdf, say
from experiments.options import NO_SETTINGS, Settings
from experiments.reconstruction.fusion import fused, open3d, tracked
from experiments.reconstruction.rebuilt import Live, rebuild, relative_errors, settled_at
from experiments.reconstruction.seen_part import Compared, Truth, compare
from experiments.registry import experiment
from experiments.several.several import noise_of
from experiments.table import Table, cells
from sdftrack.geometry import inverse

# The meshes and the seed of a part; options were chosen on those of "choose".
PARTS = {
    "choose": (("lm_cat", "lm_duck", "lm_can", "lm_driller", "spot"), 1),
    "report": (
        (
            "bunny",
            "lm_ape",
            "lm_glue",
            "mustard0 1",
            "visp_rbt 1",
            "visp_rbt 2",
            "k1 1",
            "ycbv10 1",
            "ycbv10 2",
            "ycbv10 3",
        ),
        11,
    ),
}
PATHS: tuple[Literal["turntable", "hand"], ...] = ("turntable", "hand")
DISTANCE_M = 0.7
TRUTH_VOXELS = 240
COLUMNS = {
    "case": "name",
    **{name: f"{name}:.2f" for name in ("mean_mm", "max_mm", "mean_deg", "max_deg")},
    "not_ok": "not_ok:d",
    **{name: f"{name}:.2f" for name in ("chamfer_mm", "offset")},
    "complete_%": "complete_%:.1f",
    "seen_%": "seen_%:.0f",
    "unseen_5mm_%": "unseen_5mm_%:.0f",
    "settled": "settled:d",
    "ms": "ms:.1f",
    **{name: f"{name}:.0f" for name in ("first_ms", "peak_MB")},
}


def path_of(name: str) -> Any:
    """A trajectory by name."""
    from sdftrack.synth.trajectories import orbit, random_walk

    if name == "turntable":
        return orbit(distance_m=DISTANCE_M, turns=1.0, elevation_rad=0.5)
    return random_walk(step_m=0.002, step_rad=float(np.radians(2.0)), distance_m=DISTANCE_M)


@dataclass(frozen=True)
class Setting:
    """What all cases share."""

    data: Path
    frames: int
    mode: str
    voxels: int
    threads: int
    options: Any
    refine: bool
    peers: bool
    cache: Path | None
    seed: int


def run_case(name: str, path: str, noise: str, s: Setting) -> dict[str, dict[str, Any]]:
    """Rows of one object, path and noise: live, and as asked for refined and fusion."""
    mesh = load_mesh(s.data, name)
    seq = st.synth.sequence(
        mesh, s.frames, path_of(path), noise_of(noise, 0.0), seed=s.seed, clutter="wall",
        threads=s.threads, cache=s.cache,
    )  # fmt: skip
    poses = np.array([seq.ground_truth[i][0] for i in range(s.frames)])
    truth = Truth.of(mesh, load_sdf(mesh, name, TRUTH_VOXELS, s.cache), seq.camera, poses)
    star = st.Reconstructor(seq.camera, voxels=s.voxels, mode=s.mode, threads=s.threads, **s.options)
    live = rebuild(star, seq, truth, s.frames)
    own_true = inverse(live.poses[0]) @ poses[0]
    middle = mesh.bounds.mean(axis=0)
    key = f"{name} {path} {noise}"
    rows = {key: live_row(live, poses, middle) | shape_row(compare(_in_truth(star, own_true), truth))}
    if s.refine:
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
    if s.peers:
        voxel_m = star.shape.voxel_size
        plain = fused(seq, s.frames, poses, voxel_m)
        rows[f"{key}, fusion"] = shape_row(compare(plain, truth))
        rows[f"{key}, ICP"] = icp_row(seq, poses, voxel_m, middle, truth)
    return rows


def icp_row(seq: Any, poses: Any, voxel_m: float, middle: Any, truth: Truth) -> dict[str, Any]:
    """Numbers of Open3D's frame-to-model ICP and the fusion at its poses; it raises where it is lost."""
    try:
        found, seconds = tracked(seq, len(poses), poses[0], voxel_m)
    except RuntimeError:
        return {"not_ok": len(poses)}
    return (
        pose_row(found, poses, middle)
        | shape_row(compare(fused(seq, len(poses), found, voxel_m), truth))
        | {"ms": 1e3 * float(np.median(seconds[1:])), "first_ms": 1e3 * float(seconds[0])}
    )


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
        "unseen_5mm_%": 100 * c.guessed,
    }  # fmt: skip


@experiment(
    "reconstruction",
    needs=["meshes"],
    uses=["package:open3d"],
    chosen_on="part choose: lm_cat, lm_duck, lm_can, lm_driller, spot; both paths, seed 1",
    reported_on="part report: bunny, lm_ape, lm_glue and the models of the recordings; both paths, seed 11",
    short={"only": ("spot",), "paths": ("hand",), "noise": ("1mm",), "frames": 4, "voxels": 60},
)
def reconstruction(
    *,
    data: Path,
    part: Literal["choose", "report"] = "report",
    only: tuple[str, ...] = (),
    paths: tuple[Literal["turntable", "hand"], ...] = PATHS,
    noise: tuple[str, ...] = ("1mm", "kinect"),
    mode: Literal["depth", "rgbd", "auto"] = "rgbd",
    frames: int = 300,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    refine: bool = False,
    peers: bool = False,
    cache: Path | None = None,
) -> Table:
    """Unknown objects reconstructed while they are tracked, from the mask of the first frame: poses, shape, time.

    Rendered frames before a wall, 0.7 m away: "turntable", one full turn seen from 29 degrees above, and "hand", a
    random walk of 2 mm and 2 degrees a frame. Errors of the poses are relative to the first frame, at the object's
    middle; of the shape only the part is judged that the frames have shown. "settled" is the frame from which on the
    mean error of the part shown so far stays within 0.1 mm of its last value; "offset" the signed mean distance to the
    true surface; "unseen_5mm_%" the share of the surface that none of every fifth frame shows at less than 75
    degrees and that the mesh has within 5 mm;
    "peak_MB" the peak memory of the whole process during a frame.

    Parameters
    ----------
    noise
        "kinect" or millimetres as in "1mm", comma separated
    mode
        what the poses are tracked by
    options
        of the reconstructor
    refine
        also the poses and the shape after refine()
    peers
        also Open3D's fusion, with the true poses, and with those of its frame-to-model ICP; both are told the object's
        pixels in every frame
    part
        which meshes and seed; `only` chooses among all
    """
    if peers:
        open3d()  # missing: said before the first case, not after it
    meshes, seed = PARTS[part]
    s = Setting(data, frames, mode, voxels, threads, options, refine, peers, cache, seed)
    rows: dict[str, Any] = {}
    for which in noise:
        for path in paths:
            for name in only or meshes:
                for key, row in run_case(name, path, which, s).items():
                    rows[key] = row
                    say("  ".join(cells(COLUMNS, {"name": key, **row})))
    title = f"{part}: {frames} frames, {voxels} voxels, {mode}; mm, degrees, ms, MiB"
    numbers = {key: {k: v for k, v in row.items() if not isinstance(v, list)} for key, row in rows.items()}
    return Table.of(title, COLUMNS, numbers)
