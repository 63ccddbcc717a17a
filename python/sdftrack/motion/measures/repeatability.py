# SPDX-License-Identifier: MIT
"""How alike the repetitions are: dynamic time warping of their paths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import number, numbers

Array = NDArray[np.float64]
POINTS = 60  # of a resampled path
BAND = 0.15
MOST_PAIRS = 200


def dtw_distance(a: ArrayLike, b: ArrayLike, band: float = BAND) -> float:
    """Mean distance of two paths along the best alignment of their times, in their unit.

    Dynamic time warping (Sakoe and Chiba 1978, symmetric, their band) of points (n, d) and (m, d): the sum of the
    distances of the points that the alignment pairs, over the number of pairs.

    Parameters
    ----------
    a, b : (n, d), (m, d) array
    band : float
        Largest shift of time, as a part of the paths; at least one point of the shorter one.

    >>> dtw_distance([[0.0], [1], [2]], [[0.0], [0], [1], [2]], 1)
    0.0
    """
    x, y = numbers(a, "a"), numbers(b, "b")
    if x.ndim != 2 or y.ndim != 2 or x.shape[1] != y.shape[1] or not len(x) or not len(y):
        raise ValueError(f"a, b: expected points (n, d) and (m, d), got shapes {x.shape} and {y.shape}")
    if not 0 < number(band, "band") <= 1:
        raise ValueError(f"band: expected more than 0 and at most 1, got {band!r}")
    n, m = len(x), len(y)
    distance = np.linalg.norm(x[:, None] - y[None], axis=-1)
    i, j = np.ogrid[:n, :m]
    width = max(band, 1 / min(n, m))  # or no alignment of a short path with a long one would fit in the band
    distance[np.abs(i / max(n - 1, 1) - j / max(m - 1, 1)) > width] = np.inf
    best = np.full((n + 1, m + 1), np.inf)
    best[0, 0] = 0.0
    for k in range(n + m - 1):  # one diagonal i + j = k at a time: its cells depend on earlier ones alone
        r = np.arange(max(0, k - m + 1), min(n, k + 1))
        c = k - r
        before = np.minimum(np.minimum(best[r, c + 1], best[r + 1, c]), best[r, c])
        best[r + 1, c + 1] = before + distance[r, c]
    return float(best[n, m] / _pairs(best))


def _pairs(best: Array) -> int:
    """Number of pairs of the best alignment, walked back from its end."""
    i, j, count = best.shape[0] - 1, best.shape[1] - 1, 0
    while i and j:
        count += 1
        i, j = min(((i - 1, j - 1), (i - 1, j), (i, j - 1)), key=lambda cell: best[cell])
    return count


def mean_dtw_distance(paths: Sequence[Array]) -> float:
    """Mean :func:`dtw_distance` over the pairs of paths (n, 3), each resampled to 60 points; NaN for fewer than two.

    Of more than 200 pairs every k-th is used.
    """
    even = [_resampled(p) for p in paths]
    pairs = [(i, j) for i in range(len(even)) for j in range(i)]
    chosen = pairs[:: max(1, -(-len(pairs) // MOST_PAIRS))]
    return float(np.mean([dtw_distance(even[i], even[j]) for i, j in chosen])) if chosen else float("nan")


def _resampled(path: Array) -> Array:
    at = np.linspace(0, len(path) - 1, POINTS)
    return np.column_stack([np.interp(at, np.arange(len(path)), column) for column in path.T])
