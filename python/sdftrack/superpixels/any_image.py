# SPDX-License-Identifier: MIT
"""Clustering for what the core does not segment: volumes, any number of channels, spacing, SLIC-zero. In numpy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
REACH = 2  # sides of a cell from a centre to the furthest pixel that may be its own


@dataclass(frozen=True)
class Clustering:
    """Options of `segment`; `spacing` has a number per spatial axis."""

    n_segments: int
    compactness: float
    max_num_iter: int
    spacing: Array
    adaptive: bool  # SLIC-zero: each segment's compactness is its largest colour distance of the last round
    min_size_factor: float
    connected: bool
    start_label: int


def segment(features: Array, inside: NDArray[np.bool_], options: Clustering) -> NDArray[np.int32]:
    """Labels of an image or volume (..., C): `start_label`, ... in raster order of the segments, 0 outside `inside`."""
    places, side = _first_places(inside, options.n_segments)
    colors = features[tuple(np.rint(places).astype(int).T)]
    nearest = np.full(inside.shape, -1)
    scale = np.full(len(places), options.compactness)
    for _ in range(options.max_num_iter):
        nearest, color_d2 = _assign(features, inside, places, colors, scale, side, options.spacing)
        moved_places, moved_colors = _means(nearest, features, places, colors)
        if options.adaptive:
            scale = _largest(nearest, color_d2, scale)
        elif np.array_equal(moved_places, places) and np.array_equal(moved_colors, colors):
            break
        places, colors = moved_places, moved_colors
    if not options.connected:
        return _numbered(nearest, inside, options.start_label, False)
    least = int(options.min_size_factor * inside.sum() / len(places))
    return _numbered(_connected(nearest, inside, least), inside, options.start_label, True)


def _first_places(inside: NDArray[np.bool_], n_segments: int) -> tuple[Array, float]:
    """Means of the pixels of each cell of a grid over the mask's bounding box, and the longest side of a cell."""
    where = np.argwhere(inside)
    low, size = where.min(axis=0), np.ptp(where, axis=0) + 1
    n = min(n_segments * size.prod() / len(where), size.prod())
    # The axes that are shorter than a cell have one, and the cells are cubes along the others.
    side, thin = 1.0, np.zeros(len(size), bool)
    for _ in size:
        side = float((size[~thin].prod() / n) ** (1 / max(1, (~thin).sum()))) if not thin.all() else 1.0
        thin = size < side
    cells = np.clip(np.rint(size / side).astype(int), 1, size)
    cell = np.ravel_multi_index(tuple(((where - low) * cells // size).T), tuple(cells))
    present, index = np.unique(cell, return_inverse=True)
    counts = np.bincount(index)
    means = np.stack([np.bincount(index, axis) / counts for axis in where.T], axis=-1)
    d2 = ((where - means[index]) ** 2).sum(axis=1)
    order = np.lexsort((np.arange(len(where)), d2, index))
    first = order[np.searchsorted(index[order], np.arange(len(present)))]
    return where[first].astype(float), float((size / cells).max())


def _assign(
    features: Array, inside: NDArray[np.bool_], places: Array, colors: Array, scale: Array, side: float,
    spacing: Array,
) -> tuple[NDArray[np.int64], Array]:  # fmt: skip
    """For each pixel the nearest centre within reach, of equals the first, and the colour distance squared."""
    best, color_d2 = np.full(inside.shape, np.inf), np.zeros(inside.shape)
    nearest = np.full(inside.shape, -1)
    for k, (place, color) in enumerate(zip(places, colors, strict=True)):
        begin = np.maximum(0, np.floor(place - REACH * side)).astype(int)
        end = np.minimum(inside.shape, np.ceil(place + REACH * side) + 1).astype(int)
        window = tuple(slice(b, e) for b, e in zip(begin, end, strict=True))
        axes = [
            ((np.arange(b, e) - p) * s / side) ** 2
            for b, e, p, s in zip(begin, end, place, spacing, strict=True)
        ]
        place_d2 = sum(np.ix_(*axes))
        colored = ((features[window] - color) ** 2).sum(axis=-1)
        d2 = colored / scale[k] ** 2 + place_d2
        closer = (d2 < best[window]) & inside[window]
        for whole, part in ((best, d2), (nearest, k), (color_d2, colored)):
            whole[window] = np.where(closer, part, whole[window])
    lost = inside & (nearest < 0)  # in no centre's reach, as in a mask of far pieces
    for at in np.argwhere(lost):
        nearest[tuple(at)] = int((((places - at) * spacing) ** 2).sum(axis=1).argmin())
    return nearest, color_d2


def _means(nearest: NDArray[np.int64], features: Array, places: Array, colors: Array) -> tuple[Array, Array]:
    """Centres without pixels stay."""
    at = np.nonzero(nearest >= 0)
    index, n = nearest[at], len(places)
    counts = np.bincount(index, minlength=n)
    some = counts > 0
    out = []
    for values, before in ((np.stack(at, axis=-1), places), (features[at], colors)):
        sums = np.stack([np.bincount(index, v, n) for v in values.T], axis=-1)
        out.append(np.where(some[:, None], sums / np.maximum(counts, 1)[:, None], before))
    return out[0], out[1]


def _largest(nearest: NDArray[np.int64], color_d2: Array, scale: Array) -> Array:
    largest = np.zeros(len(scale))
    at = nearest >= 0
    np.maximum.at(largest, nearest[at], color_d2[at])
    return np.where(largest > 0, np.sqrt(largest), scale)


def _edges(shape: tuple[int, ...]) -> NDArray[np.int64]:
    """Pairs of pixels that touch, by their numbers."""
    number = np.arange(np.prod(shape)).reshape(shape)
    pairs = []
    for axis in range(len(shape)):
        n = shape[axis]
        pairs.append(
            np.stack([number.take(range(n - 1), axis).ravel(), number.take(range(1, n), axis).ravel()])
        )
    return np.concatenate(pairs, axis=1)


def _joined(n: int, a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1])


def _connected(nearest: NDArray[np.int64], inside: NDArray[np.bool_], least: int) -> NDArray[Any]:
    """Connected regions of one centre, those below `least` joined with their largest neighbour."""
    flat, within = nearest.ravel(), inside.ravel()
    edges = _edges(nearest.shape)
    edges = edges[:, within[edges[0]] & within[edges[1]]]
    same = flat[edges[0]] == flat[edges[1]]
    region = _first_seen(_joined(flat.size, edges[0, same], edges[1, same]))
    while True:
        sizes = np.bincount(region[within], minlength=region.max() + 1)
        a, b = region[edges[0]], region[edges[1]]
        pairs = np.unique(np.concatenate([[a, b], [b, a]], axis=1)[:, np.tile(a != b, 2)], axis=1)
        pairs = pairs[:, sizes[pairs[0]] < least]
        if pairs.shape[1] == 0:
            return region.reshape(nearest.shape)
        pairs = pairs[:, np.lexsort((pairs[1], -sizes[pairs[1]], pairs[0]))]
        chosen = pairs[:, np.unique(pairs[0], return_index=True)[1]]
        region = _first_seen(_joined(len(sizes), chosen[0], chosen[1])[region])


def _first_seen(labels: NDArray[Any]) -> NDArray[Any]:
    """Renumbered in the order in which they come."""
    _, first, index = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[index.reshape(-1)]


def _numbered(
    labels: NDArray[Any], inside: NDArray[np.bool_], start_label: int, in_order: bool
) -> NDArray[np.int32]:
    out = np.zeros(inside.shape, np.int32)
    kept = labels[inside]
    ranks = _first_seen(kept) if in_order else np.unique(kept, return_inverse=True)[1].reshape(-1)
    out[inside] = start_label + ranks
    return out
