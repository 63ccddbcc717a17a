# SPDX-License-Identifier: MIT
"""Two objects: contact of their surfaces, and symmetry of what is measured of them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import number, numbers, of_kind
from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Definition, of_two_objects
from sdftrack.motion.intervals import Measured, measured
from sdftrack.motion.measures.contact import contacts, surface_distances
from sdftrack.motion.measures.symmetry_index import symmetry_index
from sdftrack.motion.samples import MotionSamples

__all__ = ["contact", "symmetry"]

Array = NDArray[np.float64]
RATE_HZ = 30.0
SAMPLES = 40  # of the posterior: each of them asks the distances of all points
MOST_POINTS = 500
MEASURES = (
    ("surface_distance", "m", "Smallest distance of the surfaces.", 0.01),
    ("contact_time", "s", "Time with a smaller distance than the threshold.", 0.5),
    ("contacts", "1", "Number of contacts.", 1.5),
)


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
    mean = _touches(first.motion.mean(times), second.motion.mean(times), shape, points, near)
    # The samples of two objects are drawn alike, and their errors are not: those of the second are shifted.
    drawn = _some(first.motion.samples(times), 0), _some(second.motion.samples(times), 1)
    each = _touches(*drawn, shape, points, near)
    values = {}
    for (name, unit, text, wide), at_mean, sampled in zip(MEASURES, mean, each, strict=True):
        asked = Definition(
            name, name, unit, text, "", wide, False, of_two_objects, signed=name == "surface_distance"
        )
        values[name] = measured(asked, float(at_mean[0]), sampled)
    return values


def symmetry(left: Analysis, right: Analysis) -> dict[str, Measured]:
    """Symmetry of two hands or of two objects: :func:`symmetry_index` of each average, in percent.

    Measures that are undefined or 0 in both are left out. The intervals
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
        value = 100 * float(symmetry_index(a.value, b.value))
        if not np.isfinite(value):
            continue
        half_a, half_b = 0.5 * (a.high - a.low), 0.5 * (b.high - b.low)
        half = 400 / total**2 * float(np.hypot(b.value * half_a, a.value * half_b))
        fine = a.determined and b.determined
        out[name] = Measured(name, "%", value, value - half, value + half, fine, a.note or b.note)
    return out


def _touches(a: MotionSamples, b: MotionSamples, shape: Any, points: Array, near: float) -> tuple[Array, ...]:
    """Smallest distance, time of contact and number of contacts, (S,) each; gaps of either count as apart."""
    distances = np.nan_to_num(surface_distances(a, b, shape, points), nan=np.inf)
    found = contacts(distances, a.times_s, touching_m=near)
    return found.nearest_m, found.share * len(a.times_s) / RATE_HZ, found.count


def _some(samples: MotionSamples, shift: int) -> MotionSamples:
    """The first 40 samples, or those after the first `shift`."""
    fields = {f.name: getattr(samples, f.name) for f in dataclasses.fields(samples) if f.init}
    kept = slice(shift, shift + SAMPLES)
    return MotionSamples(**{k: v if k in ("times_s", "observed") else v[kept] for k, v in fields.items()})
