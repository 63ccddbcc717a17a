# SPDX-License-Identifier: MIT
"""Contact between two objects: the distance of their surfaces over time, and when it is small."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import number, numbers
from sdftrack.motion.measures.runs import MIN_S, beginnings, settled
from sdftrack.motion.samples import MotionSamples
from sdftrack.sdf import SDF

__all__ = ["Contacts", "contacts", "surface_distances"]

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
    points = numbers(points_b, "points_b")
    if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
        raise ValueError(f"points_b: expected points (V, 3), finite, at least one, got shape {points.shape}")
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


def contacts(
    distances_m: ArrayLike, times_s: ArrayLike, *, touching_m: float = TOUCHING_M, min_s: float = MIN_S
) -> Contacts:
    """When two objects touch: their distance is `touching_m` or less.

    Breaks shorter than `min_s` do not end a contact, and what is then shorter than that is none.

    Parameters
    ----------
    distances_m : (S, n) array
        Of :func:`surface_distances`.
    times_s : (n,) array
        Regular, at least two.
    touching_m : float
        Above the error of shapes and poses together.
    min_s : float

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
    if not 0 <= number(min_s, "min_s") < np.inf:
        raise ValueError(f"min_s: expected 0 or more, got {min_s!r}")
    touch = settled(d <= limit, 1 / float(t[1] - t[0]), min_s)
    first = np.where(touch.any(axis=1), t[touch.argmax(axis=1)], np.nan)
    values = touch.mean(axis=1), first, beginnings(touch).sum(axis=1), d.min(axis=1)
    known = np.isfinite(d).all(axis=1)
    return Contacts(*(np.where(known, v, np.nan) for v in values))
