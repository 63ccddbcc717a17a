# SPDX-License-Identifier: MIT
"""Comparison of recorded results with ground truth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.evaluation.bop_scores import bop_errors
from sdftrack.evaluation.object_score import ObjectScore
from sdftrack.evaluation.report_matching import (
    check_frames,
    check_object,
    instances_of,
    known_symmetries,
    true_frame,
)
from sdftrack.evaluation.report_shown import HEAD, plot_errors, plot_trajectories, table_rows
from sdftrack.io.report_file import read_results
from sdftrack.metrics import add, adds, mssd, pose_error
from sdftrack.symmetry import Symmetry

__all__ = [
    "HEAD",
    "ObjectScore",
    "compare",
    "plot_errors",
    "plot_trajectories",
    "read_results",
    "table_rows",
]

Array = NDArray[np.float64]


def compare(
    report: dict[str, Any], seq: Any, symmetries: dict[int, Symmetry | None] | None = None
) -> list[ObjectScore]:
    """Score every object of a report against the sequence's ground truth.

    A reconstruction defines its own object frame: its poses are compared as if the first one were true. `symmetries`,
    by obj_id, take precedence over those of the results or the data set.
    """
    if not seq.ground_truth:
        raise ValueError("ground truth: this sequence has none; expected scene_gt.json, poses or the like")
    number = {im_id: i for i, im_id in enumerate(seq.ids)}
    frames = report["frames"]
    if not frames:
        raise ValueError("results: the report has no frame")
    check_frames(frames, number)
    scores = []
    instances = instances_of(report, seq)
    known = known_symmetries(report, seq)
    if symmetries is not None:
        known = [symmetries.get(int(e["obj_id"])) for e in frames[0]["objects"]]
    for k, entry in enumerate(frames[0]["objects"]):
        check_object(report, seq, k, instances[k])
        mesh = seq.models.get(entry["obj_id"])
        rows: list[tuple[int, float, float, float, Array, Array]] = []
        compared = lost = 0
        T_obj_true = true_frame(
            report, k, seq.ground_truth.get(number.get(frames[0]["im_id"], -1), {}).get(instances[k])
        )
        for frame in frames:
            now = frame["objects"][k]
            good = now["status"] in ("ok", "weak") and now["pose"] is not None
            lost += not good
            truth = seq.ground_truth.get(number.get(frame["im_id"], -1), {}).get(instances[k])
            if truth is None:
                continue
            compared += 1
            if good:
                T = np.asarray(now["pose"], np.float64) @ T_obj_true
                metres, radians = pose_error(T, truth)
                points = None if mesh is None else mesh.vertices[:: max(1, len(mesh.vertices) // 2000)]
                distance = float("nan") if points is None else add(T, truth, points)
                rows.append((frame["im_id"], metres, radians, distance, T, np.asarray(truth, np.float64)))
        symmetric = (np.zeros(0), np.zeros(0))
        if rows and mesh is not None:
            symmetric = _symmetric_errors(rows, mesh, known[k])
        elif rows:
            symmetric = (np.full(len(rows), np.nan), np.full(len(rows), np.nan))
        bop = None
        if rows and mesh is not None:
            images = [number[r[0]] for r in rows]
            bop = bop_errors(
                seq, images, np.array([r[4] for r in rows]), np.array([r[5] for r in rows]), mesh, known[k]
            )
        columns = list(zip(*rows, strict=True)) if rows else [()] * 6
        scores.append(
            ObjectScore(
                str(entry["name"]),
                int(entry["obj_id"]),
                np.array(columns[0], np.int64),
                np.array(columns[1], np.float64),
                np.array(columns[2], np.float64),
                np.array(columns[3], np.float64),
                np.array(columns[4], np.float64).reshape(-1, 4, 4),
                np.array(columns[5], np.float64).reshape(-1, 4, 4),
                len(frames),
                compared,
                lost,
                *symmetric,
                instances[k],
                known[k],
                bop,
            )
        )
    if not any(s.compared for s in scores):
        raise ValueError(
            "ground truth: no image of the results has any; is this the sequence that was tracked?"
        )
    return scores


def _symmetric_errors(rows: list[Any], mesh: Any, symmetry: Symmetry | None) -> tuple[Array, Array]:
    """ADD-S and MSSD of each row."""
    points = mesh.vertices[:: max(1, len(mesh.vertices) // 2000)]
    poses, truth = np.array([r[4] for r in rows]), np.array([r[5] for r in rows])
    worst = [mssd(T, B, points, symmetry) for T, B in zip(poses, truth, strict=True)]
    return np.asarray(adds(poses, truth, points)), np.array(worst)
