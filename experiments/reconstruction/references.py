# SPDX-License-Identifier: MIT
"""A recorded unknown object against its reference poses, its model, and a run that was given the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.protocol import say
from experiments.options import NO_SETTINGS, Settings
from experiments.reconstruction.reach import aligned_error
from experiments.reconstruction.recorded import rebuild
from experiments.reconstruction.seen_part import sampled
from experiments.registry import experiment
from experiments.table import Table, cells
from sdftrack import geometry

Array = NDArray[np.float64]
POINTS, TRUTH_VOXELS, SEEN, TOGETHER_M = 1000, 160, 0.15, 0.002
ANCHORED = {
    "anchored in frame": "anchor:d",
    "ADD mm": "add_mm:.2f",
    "AUC ADD": "auc_add:.1f",
    "ADD-S mm": "adds_mm:.2f",
    "AUC ADD-S": "auc_adds:.1f",
    "mesh's run, ADD mm": "known_mm:.2f",
    "apart mm": "apart_mm:.2f",
    "within 2 mm %": "together:.0f",
}
SHAPE = {
    "frames": "frames:d",
    "ok": "ok:d",
    "lost": "lost:d",
    "seen to model mm": "seen_mm:.2f",
    "all to model mm": "all_mm:.2f",
    "model to mesh mm": "back_mm:.2f",
    "first ms": "first_ms:.0f",
    "ms": "ms:.1f",
}


@experiment(
    "reconstruction.references",
    needs=["mustard0"],
    chosen_on="nothing was chosen on these measures; margins of masks and planes on these frames",
    reported_on="mustard0, its 200 frames",
    short={"frames": 6, "voxels": 64},
)
def references(
    *,
    data: Path,
    frames: int = 200,
    anchors: tuple[int, ...] = (0, 150),
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> list[Table]:
    """An unknown object from its first mask: ADD and ADD-S against the reference, and against the mesh's own run.

    The reference's object frame is joined to the reconstruction's in one frame, the anchor: all errors there are 0.
    "mesh's run" tracks the model from the same mask, joined in the same frame; "apart" is the mean distance of the
    model's points between the two runs. The surface is compared after the rigid motion that fits its seen part best;
    a lost frame counts as infinitely far.

    Parameters
    ----------
    anchors
        frames in which the object frames are joined
    """
    with st.open_sequence(data / "mustard0") as seq:
        n = min(frames, len(seq))
        model = next(iter(seq.models.values()))
        mask, settings = seq.masks(0)[0], {"voxels": voxels, "threads": threads, **options}
        star, results = rebuild(seq, mask, n, settings)
        tracker = st.Tracker(st.SDF.from_mesh(model, voxels=voxels), seq.camera, threads=threads)
        known = [tracker.start(seq[0], mask=mask)] + [tracker.track(seq[i]) for i in range(1, n)]
        truth = np.array([seq.ground_truth[i][0] for i in range(n)])
    points, _ = sampled(model, POINTS)
    rows = {str(a): anchored(a, poses_of(results), poses_of(known), truth, points) for a in anchors if a < n}
    for row in rows.values():
        say("  ".join(cells(ANCHORED, row)))
    times = 1e3 * np.array([r.seconds for r in results])
    said = [str(r.status[0].value) for r in results]
    start = geometry.inverse(truth[n - 1]) @ results[n - 1].pose
    shape = surface_row(star.mesh(), model, start) | {
        "frames": n, "ok": said.count("ok"), "lost": said.count("lost"), "first_ms": times[0], "ms": np.median(times)
    }  # fmt: skip
    return [
        Table.of("mustard0 from its first mask: poses", ANCHORED, rows),
        Table.of("mustard0 from its first mask: surface", SHAPE, {"mustard0": shape}),
    ]


def poses_of(results: list[Any]) -> Array:
    """Poses (N, 4, 4); those of lost frames are NaN."""
    return np.array([np.full((4, 4), np.nan) if r.status[0] == "lost" else r.pose for r in results])


def anchored(a: int, found: Array, known: Array, truth: Array, points: Array) -> dict[str, Any]:
    """Errors of two runs whose object frames are joined to the truth's in frame `a`."""
    inverse = geometry.inverse
    ours = found @ inverse(found[a]) @ truth[a]
    measures = [
        np.array([np.inf if np.isnan(T).any() else float(of(T, t, points)) for T, t in zip(poses, truth, strict=True)])
        for of, poses in (
            (st.metrics.add, ours),
            (st.metrics.adds, ours),
            (st.metrics.add, known @ inverse(known[a]) @ truth[a]),
        )
    ]  # fmt: skip
    together = found @ inverse(found[a]) @ known[a]
    apart = np.array([
        np.inf if np.isnan(T + K).any() else float(st.metrics.add(T, K, points))
        for T, K in zip(together, known, strict=True)
    ])  # fmt: skip
    return {
        "anchor": a,
        "add_mm": 1e3 * measures[0].mean(),
        "auc_add": 100 * float(st.metrics.auc(measures[0])),
        "adds_mm": 1e3 * measures[1].mean(),
        "auc_adds": 100 * float(st.metrics.auc(measures[1])),
        "known_mm": 1e3 * measures[2].mean(),
        "apart_mm": 1e3 * apart.mean(),
        "together": 100 * float(np.mean(apart < TOGETHER_M)),
    }


def surface_row(mesh: Any, model: Any, T_model_own: Array) -> dict[str, float]:
    """Mean distances (mm) between a reconstruction and the model, after the best motion of the seen part."""
    field = st.SDF.from_mesh(model, voxels=TRUTH_VOXELS)
    seen = mesh.vertices[mesh.seen >= SEEN]
    off, T = aligned_error(field, seen, T_model_own)
    placed = mesh.transformed(T)
    back = st.SDF.from_mesh(placed, voxels=TRUTH_VOXELS, holes="close", unit="m")
    points, _ = sampled(model, 10 * POINTS)
    return {
        "seen_mm": 1e3 * off,
        "all_mm": 1e3 * float(np.abs(field(placed.vertices)).mean()),
        "back_mm": 1e3 * float(np.abs(back(points)).mean()),
    }
