# SPDX-License-Identifier: MIT
"""Comparison of recorded results with ground truth: which object is which, errors of each, a table and plots."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.metrics import add, adds, auc, average_recall, mspd, mssd, pose_error, vsd
from sdftrack.metrics.scores import TAUS
from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]


def compare(
    report: dict[str, Any], seq: Any, symmetries: dict[int, Symmetry | None] | None = None
) -> list[ObjectScore]:
    """Score every object of a report against the sequence's ground truth. A reconstruction defines its own object
    frame: its poses are compared as if the first one were true. `symmetries`, by obj_id, take precedence over those of
    the results or the data set."""
    if not seq.ground_truth:
        raise ValueError(
            "ground truth: this sequence has none; expected scene_gt.json, annotated_poses/, groundtruth.txt or "
            "trajectory.log, as the layout has it (docs/data.md)"
        )
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

    def pose_of(entry: dict[str, Any]) -> Array | None:
        good = entry["status"] in ("ok", "weak") and entry["pose"] is not None
        return np.asarray(entry["pose"], np.float64) if good else None

    for k, entry in enumerate(frames[0]["objects"]):
        check_object(report, seq, k, instances[k])
        mesh = seq.models.get(entry["obj_id"])
        truths = [seq.ground_truth.get(number.get(f["im_id"], -1), {}).get(instances[k]) for f in frames]
        T_obj_true = true_frame(report, k, truths[0])
        found = [pose_of(frame["objects"][k]) for frame in frames]
        both = [i for i, T in enumerate(found) if T is not None and truths[i] is not None]
        images = [frames[i]["im_id"] for i in both]
        poses = np.reshape([found[i] for i in both], (-1, 4, 4)) @ T_obj_true
        truth = np.reshape([truths[i] for i in both], (-1, 4, 4))
        metres, radians = pose_error(poses, truth)
        distances = [np.full(len(both), np.nan)] * 3
        bop = None
        if mesh is not None and both:
            points = mesh.vertices[:: max(1, len(mesh.vertices) // 2000)]
            worst = np.array([mssd(T, B, points, known[k]) for T, B in zip(poses, truth, strict=True)])
            distances = [add(poses, truth, points), adds(poses, truth, points), worst]
            bop = bop_errors(seq, [number[i] for i in images], poses, truth, mesh, known[k])
        score = ObjectScore(
            name=str(entry["name"]), obj_id=int(entry["obj_id"]), images=np.array(images, np.int64),
            translation_m=metres, rotation_rad=radians, add_m=distances[0], adds_m=distances[1], mssd_m=distances[2],
            poses=poses, truth=truth, frames=len(frames), compared=sum(T is not None for T in truths),
            lost=sum(T is None for T in found), instance=instances[k], symmetry=known[k], bop=bop,
        )  # fmt: skip
        scores.append(score)
    if not any(s.compared for s in scores):
        raise ValueError(
            "ground truth: no image of the results has any; is this the sequence that was tracked?"
        )
    return scores


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
    entries = report["frames"][0]["objects"]
    recorded = report["settings"].get("symmetries")
    if isinstance(recorded, list) and len(recorded) == len(entries):
        return [None if s is None else Symmetry.from_bop(s) for s in recorded]
    return [getattr(seq, "symmetries", {}).get(e["obj_id"]) for e in entries]


def check_frames(frames: list[Any], number: dict[int, int]) -> None:
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
    "object", "frames", "with truth", "lost", "mean mm", "median mm", "max mm", "mean deg", "median deg",
    "max deg", "ADD mm", "ADD auc", "ADD-S mm", "MSSD mm", "MSPD px", "VSD", "AR",
]  # fmt: skip


def table_rows(scores: list[ObjectScore]) -> list[list[str]]:
    rows = []
    for score in scores:
        d = score.to_dict()

        values = [
            d[part][key] for part in ("translation_mm", "rotation_deg") for key in ("mean", "median", "max")
        ]
        values += [d["add_mm"]["mean"], d["add_auc"]]
        values += [d[part]["mean"] for part in ("adds_mm", "mssd_mm", "mspd_px", "vsd")]
        values += [(d["average_recall"] or {}).get("AR")]
        counts = [str(count) for count in (score.frames, score.compared, score.lost)]
        rows.append([score.name, *counts, *("-" if v is None else f"{v:.3f}" for v in values)])
    return rows


def plot_errors(scores: list[ObjectScore]) -> Any:
    from sdftrack.viz.plots import figure

    fig, axes = figure(2, 1, size=(8.0, 5.0), sharex=True)
    for a, label in zip(axes, ("translation error (mm)", "rotation error (deg)"), strict=True):
        for score in scores:
            errors = 1e3 * score.translation_m if a is axes[0] else np.rad2deg(score.rotation_rad)
            a.plot(score.images, errors, label=score.name, marker="o" if len(score.images) < 20 else None)
        a.set_ylabel(label)
        a.set_ylim(bottom=0)
    axes[1].set_xlabel("image")
    axes[0].legend()
    return fig


def plot_trajectories(scores: list[ObjectScore]) -> Any:
    from sdftrack.viz.plots import figure

    fig, axes = figure(3, 1, size=(8.0, 6.0), sharex=True)
    for score in scores:
        for j, a in enumerate(axes):
            line = a.plot(score.images, 1e3 * score.poses[:, j, 3], label=score.name)[0]
            a.plot(score.images, 1e3 * score.truth[:, j, 3], "--", color=line.get_color(), alpha=0.6)
            a.set_ylabel(f"{'xyz'[j]} (mm)")
    axes[0].legend(title="dashed: truth")
    axes[-1].set_xlabel("image")
    return fig


POINTS = 2000  # of the mesh, that distances are taken between
BLOCK = 500


@dataclass(frozen=True)
class BopErrors:
    """Errors of one object over the frames with a pose and ground truth. `vsd` (N, 10) is that at 5 % to 50 % of the
    diameter, NaN in frames without a depth image; `width` is that of the depth image."""

    mspd_px: Array
    vsd: Array
    diameter_m: float
    width: int

    def recall(self, mssd_m: Array, compared: int) -> dict[str, float]:
        """AR_VSD, AR_MSSD, AR_MSPD and their mean over `compared` frames; frames without a pose count as wrong. Frames
        without a depth image are excluded from VSD; without any there is no AR_VSD."""
        missing = max(0, compared - len(mssd_m))
        lost, seen = np.full(missing, np.inf), ~np.isnan(self.vsd).any(axis=1)
        errors = (
            np.concatenate([self.vsd[seen], np.full((missing, len(TAUS)), np.inf)]) if seen.any() else None
        )
        mssd_all, mspd_all = (np.concatenate([each, lost]) for each in (mssd_m, self.mspd_px))
        return average_recall(errors, mssd_all, mspd_all, self.diameter_m, self.width)


def bop_errors(
    seq: Any, frames: list[int], poses: Array, truth: Array, mesh: Any, symmetry: Symmetry | None = None
) -> BopErrors:
    """MSPD and VSD of poses (N, 4, 4) in the sequence's frames with these indices."""
    points = mesh.vertices[:: max(1, len(mesh.vertices) // POINTS)]
    across = diameter(points)
    mspd_px, discrepancy, width = np.zeros(len(frames)), np.full((len(frames), len(TAUS)), np.nan), 0
    for n, (i, T, true) in enumerate(zip(frames, poses, truth, strict=True)):
        frame = seq[i]
        lens = depth_camera(seq.camera if frame.camera is None else frame.camera)
        width = lens.width
        mspd_px[n] = mspd(T, true, points, lens, symmetry)
        if frame.depth is not None:
            found, real = (mesh.raycast(lens, P)[0] for P in (T, true))
            discrepancy[n] = vsd(frame.depth, found, real, lens, TAUS * across)
    return BopErrors(mspd_px, discrepancy, across, width)


def diameter(points: Array) -> float:
    longest = 0.0
    for k in range(0, len(points), BLOCK):
        squared = ((points[k : k + BLOCK, None] - points) ** 2).sum(axis=-1)
        longest = max(longest, float(squared.max()))
    return float(np.sqrt(longest))


@dataclass
class ObjectScore:
    """Errors of one object over the tracked images with ground truth; NaN, and no `bop`, without a model. `mssd_m` is
    over the symmetries of the results or the data set. `frames`, `compared` and `lost` are the numbers of all frames,
    of those with ground truth, and of those without a pose (lost, bad frame)."""

    name: str
    obj_id: int
    images: NDArray[np.int64]
    translation_m: Array
    rotation_rad: Array
    add_m: Array
    poses: Array
    truth: Array
    frames: int
    compared: int
    lost: int
    adds_m: Array
    mssd_m: Array
    instance: int | None = None
    symmetry: Symmetry | None = None
    bop: BopErrors | None = None

    def told(self) -> str:
        n = len(self.images)
        which = f"images {self.images.min()} to {self.images.max()}" if n else "no image"
        alike = "" if not self.symmetry else ", with its symmetries"
        against = f"against instance {self.instance}{alike}"
        missing = "; ADD, MSSD, MSPD and VSD need a mesh beside the images" if n and self.bop is None else ""
        return f"{self.name} (obj_id {self.obj_id}) {against}: {n} of {self.frames} frames compared, {which}{missing}"

    def to_dict(self) -> dict[str, Any]:
        """Summary and errors per frame in mm and degrees, ready for JSON."""
        from sdftrack.io.report_file import plain

        mm, deg, add_mm = 1e3 * self.translation_m, np.rad2deg(self.rotation_rad), 1e3 * self.add_m
        adds_mm, mssd_mm = 1e3 * self.adds_m, 1e3 * self.mssd_m
        bop, n = self.bop, len(self.images)
        mspd_px = np.zeros(0) if bop is None else bop.mspd_px
        discrepancy = np.zeros(0) if bop is None else bop.vsd.mean(axis=1)  # over BOP's tolerances

        def three(a: Array) -> dict[str, float | None]:
            if not len(a) or not np.isfinite(a).any():
                return {"mean": None, "median": None, "max": None}
            return {"mean": float(a.mean()), "median": float(np.median(a)), "max": float(a.max())}

        # A lost frame with known truth counts against the area as an infinite error.
        missing = np.full(max(0, self.compared - n), np.inf)
        area = auc(np.concatenate([self.add_m, missing])) if np.isfinite(self.add_m).any() else None
        per_frame = {
            "im_id": self.images, "translation_mm": mm, "rotation_deg": deg, "add_mm": add_mm, "adds_mm": adds_mm,
            "mssd_mm": mssd_mm, "mspd_px": None if bop is None else mspd_px,
            "vsd": None if bop is None else discrepancy,
        }  # fmt: skip
        return plain({
            "name": self.name, "obj_id": self.obj_id, "frames": self.frames, "frames_with_truth": self.compared,
            "lost": self.lost, "translation_mm": three(mm), "rotation_deg": three(deg), "add_mm": three(add_mm),
            "add_auc": area, "instance": self.instance,
            "compared_images": [int(self.images.min()), int(self.images.max())] if n else None,
            "adds_mm": three(adds_mm), "mssd_mm": three(mssd_mm), "mspd_px": three(mspd_px),
            "vsd": three(discrepancy[np.isfinite(discrepancy)]),
            "average_recall": None if bop is None else bop.recall(self.mssd_m, self.compared), "per_frame": per_frame,
        })  # fmt: skip
