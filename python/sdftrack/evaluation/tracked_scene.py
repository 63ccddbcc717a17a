# SPDX-License-Identifier: MIT
"""What the measuring commands on synthetic scenes share: shapes, arguments, one tracked sequence, its row."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from collections.abc import Sequence as Seq
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.evaluation.pose_errors import Errors, parse_settings, pose_errors, track_frames

__all__ = [
    "ASTRAY_M",
    "ASTRAY_RAD",
    "MESHES",
    "Run",
    "arguments",
    "load_sdf",
    "settings_of",
    "summary",
    "track_scene",
    "write_rows",
]

MESHES = ("lm_driller", "lm_can", "lm_cat", "spot")
ASTRAY_M, ASTRAY_RAD = 0.020, np.deg2rad(10.0)  # a frame this far off is lost, whatever the tracker says
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """One sequence tracked: errors, statuses and seconds per frame."""

    errors: Errors
    status: list[str]
    seconds: list[float]


def arguments(prog: str, doc: str | None, frames: int, seeds: int) -> argparse.ArgumentParser:
    """The arguments that every command takes."""
    p = argparse.ArgumentParser(prog=f"python -m {prog}", description=(doc or "").split("\n")[0])
    p.add_argument("--meshes", type=Path, required=True, help="folder with NAME.ply, metres")
    p.add_argument("--only", default=",".join(MESHES), help="names, comma separated")
    p.add_argument("--mode", default="depth,rgbd", help="depth, rgbd or both, comma separated")
    p.add_argument("--seeds", type=int, default=seeds)
    p.add_argument("--frames", type=int, default=frames)
    p.add_argument("--sigma", type=float, default=0.001, help="depth noise, m")
    p.add_argument("--voxels", type=int, default=200)
    p.add_argument("--threads", type=int, default=0)
    p.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE", help="of the tracker")
    p.add_argument("--cache", type=Path, help="folder that keeps volumes and noise-free images between runs")
    p.add_argument("--json", type=Path)
    return p


def settings_of(a: argparse.Namespace) -> dict[str, Any]:
    """Keyword arguments for `Tracker`."""
    return {"threads": a.threads, **parse_settings(a.set)}


def load_sdf(mesh: Any, name: str, voxels: int, cache: Path | None) -> Any:
    """The volume of a mesh, from the cache where it is kept."""
    import sdftrack as st

    kept = None if cache is None else cache / f"sdf_{name}_{voxels}.npz"
    if kept is not None and kept.is_file():
        return st.SDF.load(kept)
    sdf = st.SDF.from_mesh(mesh, voxels=voxels)
    if kept is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        sdf.save(kept)
    return sdf


def track_scene(sdf: Any, seq: Any, mode: str, options: Mapping[str, Any]) -> Run:
    """Track object 0 of a sequence from its true first pose."""
    import sdftrack as st

    tracker = st.Tracker(sdf, seq.camera, mode=mode, **options)
    results = track_frames(tracker, seq, [seq.ground_truth[0][0]])
    truth = np.array([seq.ground_truth[i][0] for i in range(len(seq))])
    return Run(
        pose_errors(np.array([r.poses[0] for r in results]), truth),
        [str(r.status[0]) for r in results],
        [r.seconds for r in results],
    )


def summary(runs: Seq[Run]) -> dict[str, Any]:
    """Plain numbers (mm, deg, counts, ms) over all frames of some runs."""
    t = np.concatenate([r.errors.translation_m for r in runs])
    r = np.concatenate([r.errors.rotation_rad for r in runs])
    status = [s for run in runs for s in run.status]
    seconds = np.concatenate([run.seconds[1:] for run in runs])
    return {
        "frames": len(t),
        "mean_mm": 1e3 * float(t.mean()),
        "max_mm": 1e3 * float(t.max()),
        "mean_deg": float(np.rad2deg(r.mean())),
        "max_deg": float(np.rad2deg(r.max())),
        "lost": sum(s in ("lost", "bad_frame") for s in status),
        "weak": status.count("weak"),
        "astray": int(np.sum((t > ASTRAY_M) | (r > ASTRAY_RAD))),
        "ms_per_frame": 1e3 * float(np.median(seconds)) if len(seconds) else float("nan"),
    }


def write_rows(path: Path | None, a: argparse.Namespace, rows: Any) -> None:
    """Settings and rows as JSON, where a file is named."""
    if path is not None:
        path.write_text(json.dumps({"settings": vars(a), "rows": rows}, default=str, indent=1))
