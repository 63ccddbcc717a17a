# SPDX-License-Identifier: MIT
"""Two objects: contact of their surfaces, and symmetry of what is measured of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import number, numbers, of_kind
from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Context, Definition
from sdftrack.motion.intervals import Measured, measured
from sdftrack.motion.rests import runs
from sdftrack.motion.samples import MotionSamples

__all__ = ["contact", "symmetry_index"]

Array = NDArray[np.float64]
RATE_HZ = 30.0
SAMPLES = 40  # of the posterior: each of them asks the distances of all points
MOST_POINTS = 500
SHORTEST_S = 0.1  # a shorter contact or gap is one of noise


def contact(
    first: Analysis, second: Analysis, shape: Any, points_m: ArrayLike, *, threshold_m: float = 0.003
) -> dict[str, Measured]:
    """Distance of the surfaces of two objects and the time that they touch.

    Parameters
    ----------
    first, second : Analysis
        Of the same recording.
    shape : SDF
        Of the first object, in the frame of its trajectory.
    points_m : (K, 3) array
        Points of the second object's surface, for example its mesh's vertices, in the frame of its trajectory; of more
        than 500 every k-th is used.
    threshold_m : float
        Surfaces that are nearer touch. No less than the error of the positions tells contact from nearness.

    Returns
    -------
    dict of str to Measured
        "surface_distance" (smallest, m, below 0 where they penetrate), "contact_time" (s) and "contacts" (number, those
        and the gaps between them of 0.1 s and more).

    Raises
    ------
    TypeError, ValueError
        Other arguments, or no time in common.
    """
    of_kind(first, Analysis, "first")
    of_kind(second, Analysis, "second")
    points = numbers(points_m, "points_m")
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise ValueError(f"points_m: expected points (K, 3), got shape {points.shape}")
    near = number(threshold_m, "threshold_m")
    points = points[:: -(-len(points) // MOST_POINTS)]
    t, u = first.trajectory.times_s, second.trajectory.times_s
    start, end = max(t[0], u[0]), min(t[-1], u[-1])
    if end - start < 1 / RATE_HZ:
        raise ValueError(
            f"second: expected a trajectory of the same time, {t[0]:g} to {t[-1]:g} s, got {u[0]:g} to {u[-1]:g} s"
        )
    times = np.arange(start, end, 1 / RATE_HZ)
    mean = _distances(first.motion.mean(times), second.motion.mean(times), shape, points)
    each = _distances(first.motion.samples(times), second.motion.samples(times), shape, points)
    values = {}
    for name, unit, text, wide, compute in (
        ("surface_distance", "m", "Smallest distance of the surfaces.", 0.01, lambda d: np.nanmin(d, axis=1)),
        (
            "contact_time",
            "s",
            "Time with a smaller distance than the threshold.",
            0.5,
            lambda d: _time(d, near),
        ),
        ("contacts", "1", "Number of contacts.", 1.5, lambda d: _count(d, near)),
    ):
        asked = Definition(
            name, name, unit, text, "", wide, False, _nothing, signed=name == "surface_distance"
        )
        values[name] = measured(asked, float(compute(mean)[0]), compute(each))
    return values


def symmetry_index(left: Analysis, right: Analysis) -> dict[str, Measured]:
    """Symmetry of two hands or of two objects: (L - R) / (0.5 (L + R)) of each average, in percent.

    0 is symmetric; Robinson, Herzog and Nigg 1987. Measures that are undefined or 0 in both are left out. The intervals
    are those of the averages, propagated to first order.
    """
    of_kind(left, Analysis, "left")
    of_kind(right, Analysis, "right")
    out = {}
    for name, a in left.averages.items():
        b = right.averages.get(name)
        if b is None or not np.isfinite([a.value, b.value]).all() or a.value + b.value == 0:
            continue
        total = a.value + b.value
        value = 200 * (a.value - b.value) / total
        half_a, half_b = 0.5 * (a.high - a.low), 0.5 * (b.high - b.low)
        half = 400 / total**2 * float(np.hypot(b.value * half_a, a.value * half_b))
        fine = a.determined and b.determined
        out[name] = Measured(name, "%", value, value - half, value + half, fine, a.note or b.note)
    return out


def _distances(first: MotionSamples, second: MotionSamples, shape: Any, points: Array) -> Array:
    """(S, n) smallest distance of the points of the second object from the first one's surface; NaN in gaps."""
    S = min(len(first.positions_m), SAMPLES)
    out = np.full((S, len(first.times_s)), np.nan)
    seen = np.flatnonzero(first.observed & second.observed)
    for s in range(S):
        R = np.swapaxes(first.rotations[s, seen], 1, 2)
        moved = np.einsum("nij,kj->nki", R @ second.rotations[s, seen], points)
        moved += np.einsum("nij,nj->ni", R, second.positions_m[s, seen] - first.positions_m[s, seen])[:, None]
        out[s, seen] = np.asarray(shape(moved.reshape(-1, 3))).reshape(len(seen), -1).min(axis=1)
    return out


def _time(distances: Array, near: float) -> Array:
    return np.asarray((distances < near).sum(axis=1) / RATE_HZ)


def _count(distances: Array, near: float) -> Array:
    least = SHORTEST_S * RATE_HZ
    counts = []
    for row in distances:
        touching = row < near
        for a, b in runs(~touching):
            if b - a < least and a > 0 and b < len(row):
                touching[a:b] = True
        counts.append(sum(b - a >= least for a, b in runs(touching)))
    return np.array(counts, dtype=np.float64)


def _nothing(samples: MotionSamples, context: Context) -> Array:
    raise NotImplementedError("computed for two objects")
