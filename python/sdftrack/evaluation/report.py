# SPDX-License-Identifier: MIT
"""Comparison of recorded results with ground truth: which object is which, scores, a table and plots of them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.evaluation.bop_scores import bop_errors
from sdftrack.evaluation.object_score import ObjectScore
from sdftrack.metrics import add, adds, mssd, pose_error
from sdftrack.symmetry import Symmetry

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


# -- Which object of a sequence each object of recorded results is, and whether they belong together


def true_frame(report: dict[str, Any], k: int, truth: Array | None) -> Array:
    """From the truth's object frame to that of the results: one for models that are tracked, chosen for an object that
    was reconstructed, so that the two agree in the first image."""
    if report["settings"].get("command") != "reconstruct":
        return np.eye(4)
    first = report["frames"][0]
    if truth is None:
        raise ValueError(
            f"ground truth: a reconstruction is compared from its first image on, and image {first['im_id']} has none"
        )
    return np.asarray(np.linalg.solve(np.asarray(first["objects"][k]["pose"], np.float64), truth), np.float64)


def known_symmetries(report: dict[str, Any], seq: Any) -> list[Symmetry | None]:
    """Symmetries of each object: those used for tracking, else those of the data set."""
    entries = report["frames"][0]["objects"]
    recorded = report["settings"].get("symmetries")
    if isinstance(recorded, list) and len(recorded) == len(entries):
        return [None if s is None else Symmetry.from_bop(s) for s in recorded]
    return [getattr(seq, "symmetries", {}).get(e["obj_id"]) for e in entries]


def check_frames(frames: list[Any], number: dict[int, int]) -> None:
    """Check that the images of the results belong to the sequence."""
    ids = [f["im_id"] for f in frames]
    foreign = [i for i in ids if i not in number]
    if len(foreign) == len(ids):
        raise ValueError(
            f"results: none of their images ({min(ids)} to {max(ids)}) is one of the sequence's ({min(number)} to "
            f"{max(number)}); is this the sequence that was tracked?"
        )
    if foreign:
        warnings.warn(
            f"results: {len(foreign)} of their {len(ids)} images are not in the sequence and are not compared",
            stacklevel=3,
        )


def check_object(report: dict[str, Any], seq: Any, k: int, instance: int | None) -> None:
    """Check that an object of the results matches its ground truth."""
    settings, entry = report["settings"], report["frames"][0]["objects"][k]
    known = settings.get("known_models")
    if settings.get("command") == "reconstruct" or not seq.models:
        return
    if isinstance(known, list) and len(known) > k and not known[k]:
        return  # tracked by a mesh of the user's own, which has no number in the data set
    own = None if instance is None or instance >= len(seq.objects) else seq.objects[instance]
    if own != entry["obj_id"]:
        has = "no instance" if own is None else f"obj_id {own} as instance {instance}"
        raise ValueError(
            f"results: object {k} ({entry['name']}) has obj_id {entry['obj_id']}, the sequence has {has} (objects "
            f"{sorted(set(seq.objects))}); is this the sequence that was tracked?"
        )


def instances_of(report: dict[str, Any], seq: Any) -> list[int | None]:
    """Instance of the ground truth for each object: as recorded, else the next unused one of its obj_id."""
    recorded = report["settings"].get("instances")
    entries = report["frames"][0]["objects"]
    if isinstance(recorded, list) and len(recorded) == len(entries):
        return recorded
    used: set[int] = set()
    out: list[int | None] = []
    for entry in entries:
        free = [k for k in range(len(seq.objects)) if k not in used]
        same = [k for k in free if seq.objects[k] == entry["obj_id"]]
        out.append((same or free or [None])[0])  # type: ignore[list-item]
        if out[-1] is not None:
            used.add(out[-1])
    return out


# -- Scores as a table and as plots


HEAD = [
    "object",
    "frames",
    "with truth",
    "lost",
    "mean mm",
    "median mm",
    "max mm",
    "mean deg",
    "median deg",
    "max deg",
    "ADD mm",
    "ADD auc",
    "ADD-S mm",
    "MSSD mm",
    "MSPD px",
    "VSD",
    "AR",
]


def table_rows(scores: list[ObjectScore]) -> list[list[str]]:
    """Rows under `HEAD`."""
    rows = []
    for score in scores:
        d = score.to_dict()

        def shown(part: str, key: str, d: dict[str, Any] = d) -> str:
            value = d[part][key]
            return "-" if value is None else f"{value:.3f}"

        rows.append(
            [score.name, str(score.frames), str(score.compared), str(score.lost)]
            + [shown(p, key) for p in ("translation_mm", "rotation_deg") for key in ("mean", "median", "max")]
            + [shown("add_mm", "mean"), "-" if d["add_auc"] is None else f"{d['add_auc']:.3f}"]
            + [shown("adds_mm", "mean"), shown("mssd_mm", "mean")]
            + [shown("mspd_px", "mean"), shown("vsd", "mean")]
            + ["-" if d["average_recall"] is None else f"{d['average_recall']['AR']:.3f}"]
        )
    return rows


def plot_errors(scores: list[ObjectScore], path: Path) -> None:
    """Translation and rotation error over the images, one curve per object."""
    from sdftrack.viz.plots import figure, save_figure

    fig, axes = figure(2, 1, size=(8.0, 5.0), sharex=True)
    for score in scores:
        marker = "o" if len(score.images) < 20 else None
        axes[0].plot(score.images, 1e3 * score.translation_m, label=score.name, marker=marker)
        axes[1].plot(score.images, np.rad2deg(score.rotation_rad), label=score.name, marker=marker)
    axes[0].set_ylabel("translation error (mm)")
    axes[1].set_ylabel("rotation error (deg)")
    axes[1].set_xlabel("image")
    for a in axes:
        a.set_ylim(bottom=0)
    axes[0].legend()
    save_figure(fig, path)


def plot_trajectories(scores: list[ObjectScore], path: Path) -> None:
    """Position over the images, truth as a dashed line."""
    from sdftrack.viz.plots import figure, save_figure

    fig, axes = figure(3, 1, size=(8.0, 6.0), sharex=True)
    for score in scores:
        for j, a in enumerate(axes):
            line = a.plot(score.images, 1e3 * score.poses[:, j, 3], label=score.name)[0]
            a.plot(score.images, 1e3 * score.truth[:, j, 3], "--", color=line.get_color(), alpha=0.6)
            a.set_ylabel(f"{'xyz'[j]} (mm)")
    axes[0].legend(title="dashed: truth")
    axes[-1].set_xlabel("image")
    save_figure(fig, path)
