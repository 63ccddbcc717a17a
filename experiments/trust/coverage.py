# SPDX-License-Identifier: MIT
"""How often the 95 % ellipsoid of a pose holds the truth: per direction, by position and rotation, jointly."""

from __future__ import annotations

from collections.abc import Sequence as Seq
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.truth import Truth, noisy

Array = NDArray[np.float64]
CHI2_95 = {1: 3.841, 3: 7.815, 6: 12.592}
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


COLUMNS = {
    "object": "name",
    "errors": "count:d",
    **{f"{what} %": f"{what}:.1f" for what in ("joint", "position", "rotation", *DIRECTIONS)},
    **{f"spread {d}": f"spread_{d}:.2f" for d in DIRECTIONS},
    **{f"offset {d}": f"offset_{d}:+.2f" for d in DIRECTIONS},
}


def row(c: Coverage) -> dict[str, float]:
    """Per cent, spreads and offsets in stated standard deviations."""
    return {
        "count": c.count,
        **{what: 100 * getattr(c, what) for what in ("joint", "position", "rotation")},
        **{d: 100 * float(x) for d, x in zip(DIRECTIONS, c.directions, strict=True)},
        **{f"spread_{d}": float(x) for d, x in zip(DIRECTIONS, c.spread, strict=True)},
        **{f"offset_{d}": float(x) for d, x in zip(DIRECTIONS, c.offset, strict=True)},
    }
