# SPDX-License-Identifier: MIT
"""An object that is reconstructed, covered wholly for a time, and seen again."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

import sdftrack as st
from experiments.common.protocol import load_mesh, say
from experiments.options import NO_SETTINGS, Settings
from experiments.reconstruction.reconstruction import PATHS, path_of
from experiments.registry import experiment
from experiments.several.several import noise_of
from experiments.table import Table, cells
from sdftrack import geometry, metrics

MESHES, SEED = ("bunny", "lm_ape", "lm_glue"), 11
COVER_M, COVER_GREY = 0.35, 90
COLUMNS = {
    "case": "name",
    "found after frames": "found:d",
    "mm": "found_mm:.2f",
    "deg": "found_deg:.2f",
    "ok after frames": "ok:d",
    "at the end": "end",
    "mm at the end": "end_mm:.2f",
    "deg at the end": "end_deg:.2f",
    "not lost while covered": "claimed:d",
}


@experiment(
    "reconstruction.hidden",
    needs=["meshes"],
    chosen_on="nothing was chosen here",
    reported_on="bunny, lm_ape, lm_glue; both paths, both noises, seed 11",
    short={
        "only": ("lm_ape",),
        "paths": ("hand",),
        "noise": ("1mm",),
        "seen": 6,
        "covered": 3,
        "after": 6,
        "voxels": 64,
    },
)
def hidden(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    paths: tuple[Literal["turntable", "hand"], ...] = PATHS,
    noise: tuple[str, ...] = ("1mm", "kinect"),
    seen: int = 50,
    covered: int = 20,
    after: int = 50,
    voxels: int = 128,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Return of an unknown object after a full occlusion, while it goes on moving behind it.

    Parameters
    ----------
    noise
        "kinect" or millimetres as in "1mm", comma separated
    seen, covered, after
        frames before, behind and after a grey board in front of the whole image
    """
    rows: dict[str, Any] = {}
    for name in only:
        mesh = load_mesh(data, name)
        for which in noise:
            for path in paths:
                n = seen + covered + after
                seq = st.synth.sequence(
                    mesh, n, path_of(path), noise_of(which, 0.0), seed=SEED, clutter="wall", threads=threads
                )
                star = st.Reconstructor(seq.camera, voxels=voxels, threads=threads, **options)
                key = f"{name} {path} {which}"
                rows[key] = row(star, seq, n, range(seen, seen + covered))
                say("  ".join(cells(COLUMNS, {"name": key, **rows[key]})))
    return Table.of(f"Covered for {covered} frames after {seen}", COLUMNS, rows)


def row(star: Any, seq: Any, n: int, away: range) -> dict[str, Any]:
    """When the object is found again, and how well; errors relative to the first frame."""
    truth = np.array([seq.ground_truth[i][0] for i in range(n)])
    middle = geometry.pose(t_m=next(iter(seq.models.values())).bounds.mean(axis=0))
    poses, status = [], []
    for i in range(n):
        frame = behind_a_board(seq[i]) if i in away else seq[i]
        result = star.track(frame) if i else star.start(frame, mask=seq.masks(0)[0])
        poses.append(result.pose)
        status.append(str(result.status[0]))
    own = geometry.inverse(poses[0]) @ truth[0]
    m, rad = metrics.pose_error(np.array(poses) @ own @ middle, truth @ middle)
    after = range(away.stop, n)
    found = next((i for i in after if status[i] != "lost"), None)
    sure = next((i for i in after if status[i] == "ok"), None)
    out: dict[str, Any] = {
        "end": status[-1], "end_mm": 1e3 * float(m[-1]), "end_deg": float(np.degrees(rad[-1])),
        "claimed": sum(status[i] != "lost" for i in away),
    }  # fmt: skip
    if found is not None:
        out |= {
            "found": found - away.stop,
            "found_mm": 1e3 * float(m[found]),
            "found_deg": float(np.degrees(rad[found])),
        }
    return out if sure is None else out | {"ok": sure - away.stop}


def behind_a_board(frame: Any) -> Any:
    """The frame with a grey board before everything."""
    return st.Frame(
        np.full_like(frame.depth, COVER_M), np.full_like(frame.color, COVER_GREY), timestamp=frame.timestamp
    )
