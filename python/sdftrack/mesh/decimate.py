# SPDX-License-Identifier: MIT
"""Mesh simplification by edge collapse with quadric error (Garland and Heckbert 1997).

Uses the package fast-simplification.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need

MIN_FACES = 4  # a tetrahedron
# How readily the library takes an edge that costs much, so as to be done in fewer passes: at 4 the mean error is half
# that of its own default, 7, in the same time, but on some meshes it ends before there are so few.
AGGRESSIVENESS = (4.0, 5.0, 6.0, 7.0)
# The library may glue two sheets along an edge, as thin parts fold flat. Another order of the edges, or a slightly
# smaller number, does not.
SHARES = (1.0, 0.98, 0.96, 0.93, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5)

Points = NDArray[np.float64]
Faces = NDArray[np.int32]
Indices = NDArray[np.int64]


def decimate(vertices: Points, faces: Faces, count: int) -> tuple[Points, Faces, Indices]:
    """Vertices and faces of a mesh reduced to at most `count` faces; a closed surface stays closed."""
    # Third comes for each input vertex the vertex into which it was merged; -1: it was in a part that collapsed and was
    # removed.
    library = need("fast_simplification", "export")
    if not np.isfinite(vertices).all():
        raise ValueError("vertices: every coordinate must be finite")
    # In units of the object's size, so that the library's tolerances do not depend on metres or millimetres.
    low, size = vertices.min(axis=0), max(float(np.ptp(vertices, axis=0).max()), 1e-12)
    unit = np.ascontiguousarray((vertices - low) / size)
    faces = np.array(faces, np.int32, order="C")  # the library takes no read-only arrays
    closed = is_closed(faces)
    for share, aggressiveness in itertools.product(SHARES, AGGRESSIVENESS):
        _, left, collapses = library.simplify(
            unit, faces, target_count=max(MIN_FACES, int(share * count)), agg=aggressiveness, return_collapses=True
        )  # fmt: skip
        if len(left) > count:
            continue
        points, triangles, merged_into = library.replay_simplification(unit, faces, collapses)
        points, triangles, merged_into = _without_flat_parts(points, triangles, merged_into)
        if len(triangles) >= MIN_FACES and (not closed or is_closed(triangles)):
            return size * points + low, triangles, merged_into
    kind = "closed surface" if closed else "surface"
    raise ValueError(f"faces: no {kind} of {count} faces was found for this mesh; give a larger number")


def is_closed(faces: Faces) -> bool:
    """Whether every edge belongs to two faces, once in each direction."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    many = int(faces.max(initial=0)) + 1
    there, back = edges @ [many, 1], edges @ [1, many]
    return len(np.unique(there)) == len(there) and np.array_equal(np.sort(there), np.sort(back))


def _without_flat_parts(points: Points, faces: Faces, merged_into: Indices) -> tuple[Points, Faces, Indices]:
    """Remove pairs of faces with the same three vertices, which enclose no volume, and unused vertices."""
    _, group, number = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    faces = faces[number[group.ravel()] == 1]
    used, renumbered = np.unique(faces, return_inverse=True)
    new = np.full(len(points), -1, np.int64)
    new[used] = np.arange(len(used))
    return points[used], renumbered.reshape(-1, 3).astype(np.int32), new[merged_into]


def weighted_mean_of_merged(
    values: NDArray[Any], weights: NDArray[Any] | None, merged_into: Indices, count: int
) -> NDArray[np.float64]:
    """(count, C) mean of the `values` (V, C) of all vertices merged into each, weighted by `weights` if nonzero."""
    kept = merged_into >= 0
    into, rows = merged_into[kept], values[kept].astype(np.float64)
    weight = np.ones(len(into)) if weights is None else weights[kept].astype(np.float64)
    total = np.bincount(into, weight, minlength=count)
    weight = np.where(total[into] > 0, weight, 1.0)
    total = np.bincount(into, weight, minlength=count)
    sums = np.stack([np.bincount(into, weight * column, minlength=count) for column in rows.T], axis=1)
    return np.asarray(sums / total[:, None])


def median_of_merged(values: NDArray[Any], merged_into: Indices, count: int) -> NDArray[Any]:
    """(count,) the (lower) median of the `values` (V,) of all vertices merged into each."""
    kept = np.flatnonzero(merged_into >= 0)
    order = kept[np.lexsort((values[kept], merged_into[kept]))]
    number = np.bincount(merged_into[kept], minlength=count)
    first = np.cumsum(number) - number
    return np.asarray(values[order[first + (number - 1) // 2]])
