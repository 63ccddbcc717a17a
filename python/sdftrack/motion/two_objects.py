# SPDX-License-Identifier: MIT
"""Two objects: contact of their surfaces, and symmetry of what is measured of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import number, numbers, of_kind
from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Definition
from sdftrack.motion.intervals import Measured, measured
from sdftrack.motion.measures.targets import beginnings, settled
from sdftrack.motion.samples import MotionSamples
from sdftrack.sdf import SDF

Array = NDArray[np.float64]


TOUCHING_M = 0.003


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts of two objects; NaN where a distance is not known.

    Attributes
    ----------
    share : (S,) float64
        Part of the samples in which they touch.
    onset_s : (S,) float64
        Time of the first contact; NaN also without any.
    count : (S,) float64
        Number of contacts.
    nearest_m : (S,) float64
        Smallest distance.
    """

    share: Array
    onset_s: Array
    count: Array
    nearest_m: Array


def surface_distances(a: MotionSamples, b: MotionSamples, sdf_a: SDF, points_b: ArrayLike) -> Array:
    """Distances of two objects' surfaces over time.

    The smallest signed distance of a's volume at points of b's surface. It is exact within the volume and for dense
    points; it misses a face of b that touches between points, so coarse meshes need points on their faces.

    Parameters
    ----------
    a, b : MotionSamples
        Of the objects' origins, at the same times, in the same frame. Samples that were drawn with the same random
        numbers are not independent: shift those of one object against the other's.
    sdf_a : st.SDF
        Shape of a.
    points_b : (V, 3) array
        On the surface of b, object frame, m: `sdf_b.surface_samples(500)[0]`, or `mesh.vertices` of a dense mesh.

    Returns
    -------
    (S, n) array
        m; negative where they overlap, NaN in gaps of either.
    """
    points = _surface_points(points_b, "points_b")
    if a.positions_m.shape != b.positions_m.shape or not np.allclose(a.times_s, b.times_s, rtol=0, atol=1e-6):
        raise ValueError("a, b: expected the same number of samples at the same times")
    seen = a.observed & b.observed
    distances = np.full(a.positions_m.shape[:2], np.nan)
    for s in range(len(distances)):  # one sample at a time: all points at all times of all samples are many
        to_a = np.swapaxes(a.rotations[s, seen], 1, 2)
        R = to_a @ b.rotations[s, seen]  # R_a_b
        t = to_a @ (b.positions_m - a.positions_m)[s, seen][..., None]
        distances[s, seen] = sdf_a((R @ points.T + t).swapaxes(1, 2)).min(axis=1)
    return distances


def _surface_points(points: ArrayLike, name: str) -> Array:
    p = numbers(points, name)
    if p.ndim != 2 or p.shape[1] != 3 or not len(p) or not np.isfinite(p).all():
        raise ValueError(f"{name}: expected points (K, 3), finite, at least one, got shape {p.shape}")
    return p


def contacts(distances_m: ArrayLike, times_s: ArrayLike, *, touching_m: float = TOUCHING_M) -> Contacts:
    """When two objects touch: their distance is `touching_m` or less.

    Breaks shorter than 0.1 s do not end a contact, and what is then shorter than that is none.

    Parameters
    ----------
    distances_m : (S, n) array
        Of :func:`surface_distances`.
    times_s : (n,) array
        Regular, at least two.
    touching_m : float
        Above the error of shapes and poses together.

    >>> contacts([[0.1, 0.0, 0.0, 0.1]], [0.0, 0.1, 0.2, 0.3]).share
    array([0.5])
    """
    d, t = numbers(distances_m, "distances_m"), numbers(times_s, "times_s")
    if d.ndim != 2 or t.shape != d.shape[1:] or len(t) < 2 or not len(d):
        raise ValueError(
            f"distances_m, times_s: expected (S, n) and (n,), S of 1 and n of 2 or more, got {d.shape} and {t.shape}"
        )
    if not (np.isfinite(t).all() and (np.diff(t) > 0).all()):
        raise ValueError("times_s: expected times that are finite and increase")
    limit = number(touching_m, "touching_m")
    touch = settled(d <= limit, 1 / float(t[1] - t[0]))
    first = np.where(touch.any(axis=1), t[touch.argmax(axis=1)], np.nan)
    values = touch.mean(axis=1), first, beginnings(touch).sum(axis=1), d.min(axis=1)
    known = np.isfinite(d).all(axis=1)
    return Contacts(*(np.where(known, v, np.nan) for v in values))


RATE_HZ = 30.0
SAMPLES = 40  # of the posterior: each of them asks the distances of all points
MOST_POINTS = 500
DEFINITIONS = tuple(
    Definition(name, name, unit, text, "", wide, False, signed=name == "surface_distance")
    for name, unit, text, wide in (
        ("surface_distance", "m", "Smallest distance of the surfaces.", 0.01),
        ("contact_time", "s", "Time with a smaller distance than the threshold.", 0.5),
        ("contacts", "1", "Number of contacts.", 1.5),
    )
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
    points = _surface_points(points_m, "points_m")
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
    drawn = [
        a.motion.samples(times).part(slice(k, k + SAMPLES), slice(None))
        for k, a in enumerate((first, second))
    ]
    each = _touches(drawn[0], drawn[1], shape, points, near)
    every = zip(DEFINITIONS, mean, each, strict=True)
    return {d.name: measured(d, float(at_mean[0]), sampled) for d, at_mean, sampled in every}


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


def symmetry_index(left: ArrayLike, right: ArrayLike) -> NDArray[np.float64]:
    """Difference of a measure between left and right as a part of its mean: (L - R) / (0.5 |L + R|).

    0 where both are alike, above 0 where the left is larger, within -2..2. Robinson, Herzog and Nigg 1987, Journal of
    Manipulative and Physiological Therapeutics 10:172-176, who write it in percent and right minus left. It is for
    measures with a natural zero, as lengths, times and speeds.

    Parameters
    ----------
    left, right : (...,) array
        Values or samples of the same measure.

    Returns
    -------
    (...,) array
        NaN where both are 0 or the signs differ.

    >>> float(symmetry_index(0.75, 0.25))
    1.0
    """
    # `numbers` makes arrays of at least one dimension.
    L = numbers(left, "left").reshape(np.shape(left))
    R = numbers(right, "right").reshape(np.shape(right))
    try:
        total = np.abs(L + R)
    except ValueError:
        raise ValueError(
            f"left, right: expected shapes that go together, got {L.shape} and {R.shape}"
        ) from None
    with np.errstate(divide="ignore", invalid="ignore"):
        index = (L - R) / (0.5 * total)
    return np.where((L * R >= 0) & (total > 0), index, np.nan)
