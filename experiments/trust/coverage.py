# SPDX-License-Identifier: MIT
"""How often the 95 % ellipsoid of a pose holds the truth: per direction, by position and rotation, jointly."""

from __future__ import annotations

from collections.abc import Sequence as Seq
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.table import Table
from experiments.thesis.scenes.truth import Truth, noisy
from experiments.tracking.random_starts import YCB_NAMES

__all__ = [
    "CHI2_95",
    "Coverage",
    "cells",
    "coverage",
    "error_vector",
    "recorded",
    "synthetic_coverage",
    "table",
]

Array = NDArray[np.float64]
CHI2_95 = {1: 3.841, 3: 7.815, 6: 12.592}
STILL, LAST = 25, 98  # frames of k1: nobody touches the sponges; both are followed to here
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


def error_vector(T: Array, T_true: Array) -> Array:
    """(6,) truth minus estimate in the convention of a result's covariance: t = t^ + d, R = Exp(r) R^; m, rad."""
    from sdftrack import _core

    turn = np.eye(4)
    turn[:3, :3] = T_true[:3, :3] @ T[:3, :3].T
    return np.concatenate([T_true[:3, 3] - T[:3, 3], _core.rotation_log(turn)])


@dataclass(frozen=True)
class Coverage:
    """Of N errors and the covariances that were stated with them.

    Attributes
    ----------
    directions : (6,) float64
        Share of errors within 1.96 stated sds, along x, y, z, rx, ry, rz.
    position, rotation, joint : float
        Share within the 95 % ellipsoid of 3, 3 and 6 dimensions.
    spread : (6,) float64
        Root mean square of error over stated sd: 1 is right, more is over-sure.
    offset : (6,) float64
        Mean of error over stated sd: the part that does not average out.
    """

    count: int
    directions: Array
    position: float
    rotation: float
    joint: float
    spread: Array
    offset: Array


def coverage(errors: Array, covariances: Array) -> Coverage:
    """Compare (N, 6) errors with (N, 6, 6) covariances."""
    errors, covariances = np.asarray(errors, np.float64), np.asarray(covariances, np.float64)
    z = errors / np.sqrt(np.einsum("nii->ni", covariances))

    def held(part: slice, dimensions: int) -> float:
        distance2 = [
            e[part] @ np.linalg.solve(C[part, part], e[part])
            for e, C in zip(errors, covariances, strict=True)
        ]
        return float(np.mean(np.array(distance2) < CHI2_95[dimensions]))

    return Coverage(
        len(errors),
        (z**2 < CHI2_95[1]).mean(axis=0),
        held(slice(0, 3), 3),
        held(slice(3, 6), 3),
        held(slice(0, 6), 6),
        np.sqrt((z**2).mean(axis=0)),
        z.mean(axis=0),
    )


def synthetic_coverage(
    sdf: Any,
    truths: Seq[Truth],
    sigma_m: float,
    options: dict[str, Any] | None = None,
    frames: int | None = None,
) -> Coverage:
    """Track each truth sequence (its first `frames`) once with its own white noise; every frame is one error."""
    import sdftrack as st

    errors, covariances = [], []
    for seed, truth in enumerate(truths):
        rng = np.random.default_rng([seed, 5, round(1e6 * sigma_m)])
        tracker = st.Tracker(sdf, truth.camera, mode="depth", **(options or {}))
        for i in range(min(len(truth), frames or len(truth))):
            frame = st.Frame(noisy(truth.depth(i), sigma_m, rng))
            result = tracker.track(frame) if i else tracker.start(frame, poses=[truth.poses[0]])
            if not np.isnan(result.covariance).any():
                errors.append(error_vector(result.pose, truth.poses[i]))
                covariances.append(result.covariance)
    return coverage(np.array(errors), np.array(covariances))


def recorded_coverage(
    seq: Any, k: int, sdf: Any, frames: int, references: dict[int, Array] | None, options: dict[str, Any]
) -> Coverage:
    """Errors of a recorded object that is tracked by itself from its reference pose in frame 0.

    Against `references` in their frames, or against its own mean pose (the spread alone) where there are none.
    """
    import sdftrack as st

    tracker = st.Tracker(sdf, seq.camera, mode="depth", **options)
    results = [tracker.start(seq[0], poses=[np.asarray(seq.ground_truth[0][k])])]
    results += [tracker.track(seq[i]) for i in range(1, frames)]
    if references is None:
        mean = _mean_pose(np.array([r.pose for r in results]))
        references = dict.fromkeys(range(frames), mean)
    known = [i for i in references if i < frames and not np.isnan(results[i].covariance).any()]
    errors = np.array([error_vector(results[i].pose, references[i]) for i in known])
    return coverage(errors, np.array([results[i].covariance for i in known]))


def _mean_pose(poses: Array) -> Array:
    u, _, vt = np.linalg.svd(poses[:, :3, :3].mean(axis=0))
    mean = np.eye(4)
    mean[:3, :3] = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    mean[:3, 3] = poses[:, :3, 3].mean(axis=0)
    return mean


def recorded(data: Path, options: dict[str, Any], frames: int = 0) -> dict[str, Coverage]:
    """Two sponges at rest about their mean and in the hand at their references; three objects of ycbv10."""
    import sdftrack as st

    out: dict[str, Coverage] = {}
    with st.open_sequence(data / "k1") as seq:
        sdf = st.SDF.from_mesh(next(iter(seq.models.values())))
        for k, name in enumerate(("left sponge", "right sponge")):
            out[f"{name}, at rest"] = recorded_coverage(
                seq, k, sdf, min(frames or STILL, STILL), None, options
            )
            poses = {i: np.asarray(T[k]) for i, T in seq.ground_truth.items() if k in T and i <= LAST}
            out[f"{name}, references"] = recorded_coverage(
                seq, k, sdf, min(frames or LAST + 1, LAST + 1), poses, options
            )
    with st.open_sequence(data / "ycbv10") as seq:
        for k, obj_id in enumerate(seq.objects):
            sdf = st.SDF.from_mesh(seq.models[obj_id])
            poses = {i: np.asarray(seq.ground_truth[i][k]) for i in range(len(seq))}
            out[YCB_NAMES[obj_id]] = recorded_coverage(
                seq, k, sdf, min(frames or len(seq), len(seq)), poses, options
            )
    return out


COLUMNS = (
    "object", "errors", "joint %", "position %", "rotation %", *(f"{d} %" for d in DIRECTIONS),
    *(f"spread {d}" for d in DIRECTIONS), *(f"offset {d}" for d in DIRECTIONS),
)  # fmt: skip


def cells(name: str, c: Coverage) -> list[str]:
    """A row: per cent, spreads and offsets in stated standard deviations."""
    return [
        name, str(c.count), *(f"{100 * x:.1f}" for x in (c.joint, c.position, c.rotation, *c.directions)),
        *(f"{s:.2f}" for s in c.spread), *(f"{o:+.2f}" for o in c.offset),
    ]  # fmt: skip


def table(title: str, rows: dict[str, Coverage]) -> Table:
    """A row per object."""
    return Table(title, COLUMNS, [cells(name, c) for name, c in rows.items()])
