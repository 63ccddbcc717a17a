# SPDX-License-Identifier: MIT
"""Both sponges of the recorded sequence k1: handled, turned, held against each other, partly hidden.

The reference poses end with frame 98 and the masks with 124; from then on the depth image itself is the judge: the
readings on a sponge's own pixels against its rendering, the steps from frame to frame, and the pictures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.pose_errors import pose_errors
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.several.identity import Tracked, track
from experiments.synth.contact import Solid, deepest
from experiments.table import Table
from experiments.tracking.still_and_in_hand import HIDING_M, K1_HAND_LIMITS, K1_LEAST_IOU, K1_TO_FRAME, SIDES

Array = NDArray[np.float64]
PICTURED = (150, 175, 200, 225, 250)
MEDIAN_LIMIT_M, STEP_LIMIT_M, STEP_LIMIT_RAD = 0.003, 0.060, np.deg2rad(25.0)
DEEPEST_LIMIT_M = 0.002
OWN_PIXELS = 100  # fewer say nothing of a pose
COLUMNS = {
    "way, sponge": "name",
    "lost": "lost:d",
    "weak": "weak:d",
    "IoU least": "iou_least:.3f",
    "IoU at": "iou_at:d",
    "of readings": "iou_read_least:.3f",
    "references mm / deg": "at_references",
    "readings mm": "median_mm:.2f",
    "readings at": "median_at:d",
    "unjudged": "unjudged:d",
    "step mm": "step_mm:.1f",
    "step mm at": "step_at:d",
    "step deg": "turn_deg:.1f",
    "step deg at": "turn_at:d",
    "deepest mm": "deepest_mm:.2f",
    "deepest at": "deepest_at:d",
    "ms": "ms_per_frame:.2f",
    "kept": "kept",
}


@experiment(
    "several.k1",
    needs=["k1"],
    chosen_on="k1, the same recording",
    reported_on="k1",
    short={"ways": ("joint",), "frames": 4, "voxels": 60},
)
def recorded_pair(
    *,
    data: Path,
    ways: tuple[Literal["joint", "single"], ...] = ("joint", "single"),
    mode: tuple[Literal["depth", "rgbd"], ...] = ("depth",),
    frames: int = 251,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    pictures: Path | None = None,
) -> Table:
    """Two recorded sponges, handled, turned, held against each other and partly hidden; tracked from frame 0 on.

    Parameters
    ----------
    pictures
        folder for overlays
    """
    rows: dict[str, Any] = {}
    with st.open_sequence(data / "k1") as seq:
        mesh = next(iter(seq.models.values()))
        solid = Solid.of(mesh, st.SDF.from_mesh(mesh, voxels=voxels))
        n = min(frames, len(seq))
        first = [np.asarray(seq.ground_truth[0][k]) for k in range(2)]
        for by in mode:
            for way in ways:
                images = (seq[i] for i in range(n))
                told = {"mode": by, "threads": threads, **options}
                tracked = track([solid.sdf] * 2, seq.camera, images, first, way, told)
                for k, row in enumerate(judged(seq, solid, tracked)):
                    rows[f"{way}, {by}, {SIDES[k]}"] = row
                if pictures is not None:
                    _draw(seq, solid, tracked, pictures / f"{way}_{by}")
    limits = [
        f"wanted: lost 0, IoU >= {K1_LEAST_IOU:g} to frame {K1_TO_FRAME}, references within "
        + ", ".join(f"{1e3 * m:g} mm / {np.rad2deg(r):.1f} deg" for m, r in K1_HAND_LIMITS.values()),
        f"after it readings within {1e3 * MEDIAN_LIMIT_M:g} mm (median), steps <= {1e3 * STEP_LIMIT_M:g} mm and "
        f"{np.rad2deg(STEP_LIMIT_RAD):.0f} deg; penetration < {1e3 * DEEPEST_LIMIT_M:g} mm throughout",
    ]
    return Table.of(f"k1, {n} frames", COLUMNS, rows, notes=limits)


def judged(seq: Any, solid: Solid, tracked: Tracked) -> list[dict[str, Any]]:
    """A row for each sponge; IoU and penetration are of both together."""
    n = len(tracked.poses)
    seen = [overlaps(seq, solid.sdf, i, tracked.poses[i]) for i in range(n)]
    ious, read = (
        np.array([s[j] if i <= K1_TO_FRAME else np.nan for i, s in enumerate(seen)]) for j in (0, 1)
    )
    deep = deepest(solid, tracked.poses, ~tracked.lost)
    late = np.arange(n) > K1_TO_FRAME
    rows = []
    for k in range(2):
        T = tracked.poses[:, k]
        hand = {}
        for i in sorted(seq.ground_truth):
            if 0 < i < n and k in seq.ground_truth[i]:
                e = pose_errors(T[i : i + 1], np.asarray(seq.ground_truth[i][k])[None])
                hand[i] = (1e3 * float(e.translation_m[0]), float(np.rad2deg(e.rotation_rad[0])))
        median = np.where(late, [s[2][k] for s in seen], np.nan)
        step = pose_errors(T[1:], T[:-1])
        moved, turned = (np.where(late[1:], v, np.nan) for v in (step.translation_m, step.rotation_rad))
        row: dict[str, Any] = {
            "lost": int(tracked.lost[:, k].sum()),
            "weak": int((tracked.status[:, k] == "weak").sum()),
            "iou_least": _least(ious)[0],
            "iou_at": _least(ious)[1],
            "iou_read_least": _least(read)[0],
            "references": hand,
            "at_references": " ".join(f"{i}: {mm:.1f}/{deg:.1f}" for i, (mm, deg) in hand.items()),
            "median_mm": -1e3 * _least(-np.abs(median))[0],
            "median_at": _least(-np.abs(median))[1],
            "unjudged": int(np.isnan(median[late]).sum()),
            "step_mm": -1e3 * _least(-moved)[0],
            "step_at": _least(-moved)[1] + 1,
            "turn_deg": -float(np.rad2deg(_least(-turned)[0])),
            "turn_at": _least(-turned)[1] + 1,
            "deepest_mm": 1e3 * float(deep.max()),
            "deepest_at": int(np.argmax(deep)),
            "ms_per_frame": 1e3 * float(np.median(tracked.seconds[1:])) if n > 1 else float("nan"),
        }
        limit = K1_HAND_LIMITS[k]
        row["kept"] = bool(
            row["lost"] == 0
            and not row["iou_least"] < K1_LEAST_IOU
            and all(mm <= 1e3 * limit[0] and deg <= np.rad2deg(limit[1]) for mm, deg in hand.values())
            and not row["median_mm"] > 1e3 * MEDIAN_LIMIT_M
            and not (row["step_mm"] > 1e3 * STEP_LIMIT_M or row["turn_deg"] > np.rad2deg(STEP_LIMIT_RAD))
            and row["deepest_mm"] < 1e3 * DEEPEST_LIMIT_M
        )
        rows.append(row)
    return rows


def overlaps(seq: Any, sdf: Any, i: int, poses: Array) -> tuple[float, float, list[float]]:
    """How both poses fit frame i: IoU, IoU on pixels with a reading, and a median for each sponge.

    The IoU is that of both silhouettes, less what nearer readings hide, with the mask (NaN without one). No mask has
    a pixel without a reading, so that even the reference poses reach but 0.79 in frames 12-33; hence the second one.
    The median is that of measured minus rendered depth (m) on a sponge's own pixels, NaN where these are too few.
    """
    frame, lens = seq[i], getattr(seq.camera, "depth", seq.camera)
    depths = np.array([sdf.render(lens, np.ascontiguousarray(T))[0] for T in poses])
    depths[depths == 0] = np.inf
    nearest, owner = depths.min(axis=0), depths.argmin(axis=0)
    hidden = (frame.depth > 0) & (frame.depth < nearest - HIDING_M)
    shown = np.isfinite(nearest) & ~hidden
    mask = np.zeros(shown.shape, bool)
    masks = seq.masks(i)
    for m in masks.values():
        mask |= m
    read = frame.depth > 0
    iou, iou_read = (
        _ratio(shown & w, mask & w) if masks else float("nan") for w in (np.ones_like(read), read)
    )
    medians = []
    for k in range(len(poses)):
        own = shown & (owner == k) & read
        enough = np.count_nonzero(own) >= OWN_PIXELS
        medians.append(float(np.median(frame.depth[own] - nearest[own])) if enough else float("nan"))
    return iou, iou_read, medians


def _ratio(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    return int(np.count_nonzero(a & b)) / max(1, int(np.count_nonzero(a | b)))


def _least(values: Array) -> tuple[float, int]:
    """The least value and where it is; NaN, -1 where there is none."""
    if np.isnan(values).all():
        return float("nan"), -1
    at = int(np.nanargmin(values))
    return float(values[at]), at


def _draw(seq: Any, solid: Solid, tracked: Tracked, folder: Path) -> None:
    """Overlays of some frames of the part without reference."""
    from sdftrack.io.frames import write_color
    from sdftrack.results import Status, TrackResult
    from sdftrack.viz import draw

    folder.mkdir(parents=True, exist_ok=True)
    for i in PICTURED:
        if i < len(tracked.poses):
            unknown = np.full((2, 6, 6), np.nan)
            said = TrackResult(
                tracked.poses[i], [Status(s) for s in tracked.status[i]], [""] * 2, tracked.confidence[i], unknown,
                unknown[:, 0], unknown[:, 0, 0], unknown[:, 0, 0], 0.0, index=i,
            )  # fmt: skip
            write_color(folder / f"{i:06d}.png", draw(seq[i], said, [solid.sdf] * 2, seq.camera, names=SIDES))
