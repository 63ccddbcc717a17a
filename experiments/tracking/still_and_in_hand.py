# SPDX-License-Identifier: MIT
"""The two sponges of the recorded sequence k1, each by itself: still, and in the hand."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from experiments.common.pose_errors import pose_errors, track_frames
from experiments.common.protocol import say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table

Array = NDArray[np.float64]
K1_STILL = 41  # frames 0-40: nobody touches the sponges
K1_STILL_LIMITS = {0: (0.004, np.deg2rad(2.0)), 1: (0.004, np.deg2rad(4.0))}
K1_HAND_LIMITS = {0: (0.004, np.deg2rad(2.5)), 1: (0.006, np.deg2rad(4.0))}
K1_TO_FRAME, K1_LEAST_IOU = 124, 0.8  # the last frame with a mask
HIDING_M = 0.008  # a reading this much nearer than the model hides it
K1_SPREAD_LIMIT = (0.0005, np.deg2rad(0.3))
SIDES = ("left", "right")


def _spread(poses: Array) -> tuple[float, float]:
    """Standard deviation of position (m) and orientation (rad) about their mean."""
    t = poses[:, :3, 3] - poses[:, :3, 3].mean(axis=0)
    u, _, vt = np.linalg.svd(poses[:, :3, :3].mean(axis=0))
    mean = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    angles = [np.arccos(np.clip((np.trace(mean.T @ R) - 1) / 2, -1, 1)) for R in poses[:, :3, :3]]
    return float(np.sqrt(np.mean((t**2).sum(axis=1)))), float(np.sqrt(np.mean(np.square(angles))))


def mask_iou(sdf: Any, camera: Any, frame: Any, T: Array, masks: Iterable[Any]) -> float:
    """Intersection over union of what the pose shows of the object (not hidden by a nearer reading) with a mask.

    With the best of `masks`: objects that look alike are not told apart by theirs.
    """
    depth, _ = sdf.render(getattr(camera, "depth", camera), np.ascontiguousarray(T))
    shown = (depth > 0) & ~((frame.depth > 0) & (frame.depth < depth - HIDING_M))
    ratios = [int(np.count_nonzero(shown & m)) / max(1, int(np.count_nonzero(shown | m))) for m in masks]
    return float(max(ratios, default=np.nan))


def run_k1(
    data: Path,
    frames: int,
    only: Seq[int],
    voxels: int,
    options: dict[str, Any],
    from_mask: bool,
) -> dict[str, dict[str, Any]]:
    """Track each sponge by itself from its reference pose in frame 0, or from its mask there."""
    import sdftrack as st

    out: dict[str, dict[str, Any]] = {}
    with st.open_sequence(data) as seq:
        mesh = next(iter(seq.models.values()))
        sdf = st.SDF.from_mesh(mesh, voxels=voxels)
        frames = min(frames, len(seq))
        for k in only:
            tracker = st.Tracker(sdf, seq.camera, **{"mode": "depth", **options})

            def told(i: int, result: Any, k: int = k) -> None:
                if i % 20 == 0 or not result.ok:
                    say(f"{SIDES[k]} {i:3d}: {result.status[0]} {result.reason[0]}")

            results = track_frames(
                tracker,
                (seq[i] for i in range(frames)),
                None if from_mask else [np.asarray(seq.ground_truth[0][k])],
                told,
                {"masks": [seq.masks(0)[k]]} if from_mask else None,
            )
            poses = np.array([r.poses[0] for r in results])
            overlap = {
                i: mask_iou(sdf, seq.camera, seq[i], poses[i], masks.values())
                for i in range(min(frames, K1_TO_FRAME + 1))
                if (masks := seq.masks(i))
            }
            still = poses[:K1_STILL]
            first = pose_errors(still, np.tile(seq.ground_truth[0][k], (len(still), 1, 1)))
            spread = _spread(still)
            row: dict[str, Any] = {
                "spread_mm": 1e3 * spread[0],
                "spread_deg": float(np.rad2deg(spread[1])),
                "still_max_mm": 1e3 * float(first.translation_m.max()),
                "still_max_deg": float(np.rad2deg(first.rotation_rad.max())),
                "hand": {},
                "iou_least": min(overlap.values(), default=float("nan")),
                "iou_at": min(overlap, key=lambda i: overlap[i], default=-1),
                "iou_frames": len(overlap),
                "lost": sum(str(r.status[0]) == "lost" for r in results),
                "weak": sum(str(r.status[0]) == "weak" for r in results),
                "first_lost": next((i for i, r in enumerate(results) if str(r.status[0]) == "lost"), None),
                "ms_per_frame": 1e3 * float(np.median([r.seconds for r in results])),
            }
            for i in sorted(seq.ground_truth):
                if 0 < i < frames and k in seq.ground_truth[i]:
                    e = pose_errors(poses[i : i + 1], np.asarray(seq.ground_truth[i][k])[None])
                    row["hand"][i] = (1e3 * float(e.translation_m[0]), float(np.rad2deg(e.rotation_rad[0])))
            at = (f"{i}: {mm:.1f} / {deg:.1f}" for i, (mm, deg) in row["hand"].items())
            row["in_hand"] = "  ".join(at)
            row["poses"] = poses.tolist()
            out[SIDES[k]] = row
    return out


COLUMNS = {
    "sponge": "name",
    "spread mm": "spread_mm:.3f",
    "spread deg": "spread_deg:.3f",
    "still most mm": "still_max_mm:.2f",
    "still most deg": "still_max_deg:.2f",
    "in the hand, mm / deg at frame": "in_hand",
    "IoU least": "iou_least:.3f",
    "at": "iou_at:d",
    "masks": "iou_frames:d",
    "lost": "lost:d",
    "weak": "weak:d",
    "first lost": "first_lost:d",
    "ms": "ms_per_frame:.2f",
}


@experiment(
    "real.k1",
    needs=["k1"],
    chosen_on="ycbv10 and k1",
    reported_on="k1, the same recording",
    short={"only": ("left",), "frames": 4, "voxels": 80},
)
def in_hand(
    *,
    data: Path,
    only: tuple[Literal["left", "right"], ...] = ("left", "right"),
    frames: int = 141,
    from_mask: bool = False,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Each of two recorded sponges by itself, still and in the hand.

    By depth alone; ``--set mode=rgbd`` uses colour.

    Parameters
    ----------
    from_mask
        start from the first frame's mask, not from a pose
    """
    told = {"threads": threads, **options}
    rows = run_k1(data / "k1", frames, [SIDES.index(name) for name in only], voxels, told, from_mask)
    notes = []
    for name in rows:
        limits = (K1_STILL_LIMITS[SIDES.index(name)], K1_HAND_LIMITS[SIDES.index(name)])
        at_rest, in_it = (f"{1e3 * m:g} mm / {np.rad2deg(r):g} deg" for m, r in limits)
        notes.append(f"{name}: wanted still within {at_rest} of the reference, in the hand within {in_it}")
    notes.append(
        f"wanted: spread {1e3 * K1_SPREAD_LIMIT[0]:g} mm / {np.rad2deg(K1_SPREAD_LIMIT[1]):g} deg in frames 0-40, "
        f"mask IoU {K1_LEAST_IOU:g} to frame {K1_TO_FRAME}"
    )
    return Table.of(f"k1, {frames} frames", COLUMNS, rows, notes=notes)
