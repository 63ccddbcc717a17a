# SPDX-License-Identifier: MIT
"""What the experiments on synthetic scenes share: shapes, the numbers of a row, progress."""

from __future__ import annotations

import sys
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np

from experiments.common.tracked_scene import WRONG_M, WRONG_RAD, Run

MESHES = ("lm_driller", "lm_can", "lm_cat", "spot")


def say(text: str) -> None:
    """A line of progress, beside the tables."""
    print(f"# {text}", file=sys.stderr, flush=True)


def load_mesh(data: Path, name: str) -> Any:
    """A mesh of the data folder, metres; "mustard0 1" is the model of object 1 of a recording."""
    import sdftrack as st

    recording, _, number = name.partition(" ")
    if not number:
        return st.Mesh.load(data / "meshes" / f"{name}.ply")
    with st.open_sequence(data / recording) as seq:
        return seq.models[int(number)]


def load_sdf(mesh: Any, name: str, voxels: int, cache: Path | None) -> Any:
    """The volume of a mesh, from the cache where it is kept."""
    import sdftrack as st

    kept = None if cache is None else cache / f"sdf_{name.replace(' ', '_')}_{voxels}.npz"
    if kept is not None and kept.is_file():
        return st.SDF.load(kept)
    sdf = st.SDF.from_mesh(mesh, voxels=voxels)
    if kept is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        sdf.save(kept)
    return sdf


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
        "wrong": int(np.sum((t > WRONG_M) | (r > WRONG_RAD))),
        "ms_per_frame": 1e3 * float(np.median(seconds)) if len(seconds) else float("nan"),
    }
