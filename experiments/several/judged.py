# SPDX-License-Identifier: MIT
"""What is said of several objects tracked through scenes: swaps, losses, errors, penetration, time."""

from __future__ import annotations

from collections.abc import Sequence as Seq
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.tracked_scene import WRONG_M, WRONG_RAD
from experiments.several.identity import Tracked, swapped, swaps
from experiments.synth.contact import Solid, deepest
from experiments.synth.staged import Scene

Array = NDArray[np.float64]
VISIBLE = 0.3  # of an object's silhouette: what is hidden more is not asked for
COMPARED = 100  # points of the surface over which two poses are compared
COLUMNS = {
    "case, way": "name",
    **{name: f"{name}:d" for name in ("frames", "swaps", "lost", "weak", "wrong")},
    "mean mm": "mean_mm:.3f",
    "max mm": "max_mm:.2f",
    "mean deg": "mean_deg:.3f",
    "max deg": "max_deg:.2f",
    "deepest mm": "deepest_mm:.2f",
    "ms": "ms_per_frame:.2f",
    "Hz": "hz:.0f",
}


@dataclass(frozen=True)
class Measured:
    """A scene tracked and judged; errors (n, M) in metres and radians, NaN where too little is visible."""

    metres: Array
    radians: Array
    swaps: int
    lost: int
    weak: int
    crowded: Array
    seconds: Array


def measure(scene: Scene, tracked: Tracked) -> Measured:
    """Judge one way in one scene."""
    metres, radians = errors(tracked.poses, scene.poses)
    visible = scene.share > VISIBLE
    wrong = swapped(_points(scene.solid), tracked.poses, scene.poses)
    return Measured(
        np.where(visible, metres, np.nan),
        np.where(visible, radians, np.nan),
        swaps(wrong, tracked.reported),
        int(np.count_nonzero(tracked.lost & visible)),
        int(np.count_nonzero(tracked.status == "weak")),
        deepest(scene.solid, tracked.poses, ~tracked.lost),
        tracked.seconds,
    )


def errors(poses: Array, truth: Array) -> tuple[Array, Array]:
    """Metres and radians (n, M) between poses (n, M, 4, 4)."""
    from sdftrack.metrics import pose_error

    flat = pose_error(poses.reshape(-1, 4, 4), truth.reshape(-1, 4, 4))
    metres, radians = (np.asarray(e, np.float64).reshape(poses.shape[:2]) for e in flat)
    return metres, radians


def total(parts: Seq[Measured]) -> dict[str, Any]:
    """Plain numbers (mm, deg, counts, ms) over some scenes."""
    t, r = (np.concatenate([getattr(m, name).ravel() for m in parts]) for name in ("metres", "radians"))
    t, r = t[np.isfinite(t)], r[np.isfinite(r)]
    ms = 1e3 * float(np.median(np.concatenate([m.seconds[1:] for m in parts])))
    return {
        "frames": int(sum(len(m.seconds) for m in parts)),
        "swaps": sum(m.swaps for m in parts),
        "lost": sum(m.lost for m in parts),
        "weak": sum(m.weak for m in parts),
        "wrong": int(np.count_nonzero((t > WRONG_M) | (r > WRONG_RAD))),
        "mean_mm": 1e3 * float(t.mean()),
        "max_mm": 1e3 * float(t.max()),
        "mean_deg": float(np.rad2deg(r.mean())),
        "max_deg": float(np.rad2deg(r.max())),
        "deepest_mm": 1e3 * float(max(m.crowded.max() for m in parts)),
        "ms_per_frame": ms,
        "hz": 1e3 / ms,
    }


def judge(scene: Scene, tracked: Tracked, back: int, within: int) -> tuple[int | None, bool]:
    """Of a scene whose object 0 comes back in frame `back`: frames until it is found, and whether it was swapped."""
    metres, radians = errors(tracked.poses, scene.poses)
    right = (metres <= WRONG_M) & (radians <= WRONG_RAD) & ~tracked.lost
    found = np.flatnonzero(right[back : back + within, 0])
    seen = scene.share > 0  # where nothing of it is to be seen it cannot be told from its neighbour
    wrong = swapped(_points(scene.solid), tracked.poses, scene.poses) & seen
    return (int(found[0]) + 1 if len(found) else None), swaps(wrong, tracked.reported) > 0


def _points(solid: Solid) -> Array:
    """The points over which poses are compared."""
    return solid.points[:: max(1, len(solid.points) // COMPARED)]
