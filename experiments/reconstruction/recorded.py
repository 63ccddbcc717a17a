# SPDX-License-Identifier: MIT
"""Unknown objects on recorded tables and in recorded hands, from their masks, and on rendered tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np

import sdftrack as st
from experiments.common.protocol import load_mesh, say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.synth.standing import standing
from experiments.table import Table

HEAD = [
    "object", "frames", "ok", "lost", "seen_mm", "seen_90_mm", "within_8mm_%", "seen_extent_%", "extent_%",
    "pose_mm", "pose_deg", "first_ms", "ms",
]  # fmt: skip
SEEN, TRUTH_VOXELS, NEAR_M = 0.5, 160, 0.008
CHOSEN_ON, REPORTED_ON = ("bunny", "lm_can"), ("lm_ape", "lm_cat", "lm_duck", "lm_driller")
Truth = Callable[[int], Any]


def row(star: Any, results: list[Any], truth: Truth, model: Any) -> list[str]:
    """What came out, against the model at its pose in the first frame."""
    mesh = star.mesh()
    back = np.linalg.solve(truth(0), results[0].pose)
    points = mesh.vertices @ back[:3, :3].T + back[:3, 3]
    seen = points[mesh.seen >= SEEN]
    off = np.abs(st.SDF.from_mesh(model, voxels=TRUTH_VOXELS)(seen))
    size = np.ptp(model.vertices, axis=0)

    def wider(p: Any) -> float:
        return float(100 * np.max(np.ptp(p, axis=0) / size - 1))

    errors = [
        st.metrics.pose_error(r.pose @ np.linalg.inv(back), truth(i))
        for i, r in enumerate(results)
        if truth(i) is not None and r.status[0] != "lost"
    ]
    pose = np.median(errors, axis=0)
    said = [str(r.status[0].value) for r in results]
    times = 1e3 * np.array([r.seconds for r in results])
    numbers = [
        1e3 * np.median(off), 1e3 * np.quantile(off, 0.9), 100 * np.mean(off < NEAR_M), wider(seen), wider(points),
        1e3 * pose[0], np.degrees(pose[1]),
    ]  # fmt: skip
    cells = [f"{x:.2f}" if abs(x) < 10 else f"{x:.0f}" for x in numbers]
    return [
        str(len(said)),
        str(said.count("ok")),
        str(said.count("lost")),
        *cells,
        f"{times[0]:.0f}",
        f"{np.median(times):.1f}",
    ]


def rebuild(seq: Any, mask: Any, frames: int, settings: dict[str, Any]) -> tuple[Any, list[Any]]:
    star = st.Reconstructor(seq.camera, **settings)
    results = [star.start(seq[0], mask=mask)]
    results += [star.track(seq[i]) for i in range(1, frames)]
    return star, results


@experiment(
    "reconstruction.recorded",
    needs=["k1", "visp_rbt", "mustard0", "ycbv10"],
    chosen_on="all of them: margins of the first mask and of planes",
    reported_on="the same; other recordings are to come",
    short={"only": ("ycbv10",), "voxels": 48},
)
def recorded(
    *,
    data: Path,
    only: tuple[Literal["k1", "visp_rbt", "mustard0", "ycbv10"], ...] = (
        "k1",
        "visp_rbt",
        "mustard0",
        "ycbv10",
    ),
    planes: bool = True,
    keep_to_mask: bool = True,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Unknown objects on real tables and in real hands, from their masks in the first frame.

    Parameters
    ----------
    planes, keep_to_mask
        options of the reconstructor: False and False is what it was without
    """
    settings = {
        "voxels": voxels, "threads": threads, "planes": planes, "keep_to_mask": keep_to_mask, **options
    }  # fmt: skip
    rows = []
    for name in only:
        with st.open_sequence(data / name) as seq:
            masks, truth = seq.masks(0), seq.ground_truth
            for k in sorted(masks):
                model = seq.models[1 if name == "k1" else seq.objects[k]]
                star, results = rebuild(seq, masks[k], len(seq), settings)
                cells = [
                    f"{name} {k}",
                    *row(star, results, lambda i, k=k, t=truth: t[i].get(k) if i in t else None, model),  # type: ignore[misc]
                ]
                rows.append(cells)
                say("  ".join(cells))
    title = f"from the mask of frame 0; planes={planes}, keep_to_mask={keep_to_mask}"
    return Table(title, HEAD, rows)


@experiment(
    "reconstruction.on_table",
    needs=["meshes"],
    chosen_on="bunny, lm_can (`--part choose`)",
    reported_on="lm_ape, lm_cat, lm_duck, lm_driller; seed 3",
    short={"part": "choose", "noise": ("gaussian",), "frames": 6, "voxels": 64},
)
def on_table(
    *,
    data: Path,
    part: Literal["choose", "report"] = "report",
    noise: tuple[Literal["gaussian", "kinect"], ...] = ("gaussian", "kinect"),
    frames: int = 110,
    mode: Literal["auto", "depth", "rgbd"] = "auto",
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Rendered: an object on a table, the camera half around it; and taken up and turned half way through."""
    settings = {"voxels": voxels, "threads": threads, "mode": mode, **options}
    rows = []
    for name in CHOSEN_ON if part == "choose" else REPORTED_ON:
        mesh = load_mesh(data, name)
        for kind in noise:
            for taken_up_at in (None, frames // 2):
                seq = standing(
                    mesh, frames, 0.001 if kind == "gaussian" else kind, taken_up_at=taken_up_at, seed=3
                )
                star, results = rebuild(seq, seq.masks(0)[0], frames, settings)
                cells = [
                    f"{name}, {kind}, {'stands' if taken_up_at is None else 'taken up'}",
                    *row(star, results, lambda i, s=seq: s.ground_truth[i][0], mesh),  # type: ignore[misc]
                ]
                rows.append(cells)
                say("  ".join(cells))
    return Table(f"on a rendered table, {frames} frames, {mode}", HEAD, rows)
