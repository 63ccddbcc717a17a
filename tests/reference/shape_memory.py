# SPDX-License-Identifier: MIT
"""Harmonics and remembered silhouettes, slow and obvious: the sums as the text has them, all shapes, all pixels."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Mask: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[np.float64]


def coefficient(mask: Mask, u: int, v: int) -> float:
    """C(u, v) of a square silhouette, +1 inside and -1 outside (thesis Eq. 6.1, 6.2); u counts down, v across."""
    size = mask.shape[0]
    total = 0.0
    for y in range(size):
        for x in range(size):
            f = 1.0 if mask[y, x] else -1.0
            down = np.cos(np.pi * (2 * y + 1) * u / (2 * size))
            across = np.cos(np.pi * (2 * x + 1) * v / (2 * size))
            total += f * down * across
    return float(_alpha(u, size) * _alpha(v, size) * total)


def _alpha(u: int, size: int) -> float:
    return float(np.sqrt((1 if u == 0 else 2) / size))


def sticks_out(seen: Mask, remembered: Mask) -> Array:
    """(K,) pixels of `seen` outside each of (K, N, N) silhouettes, counted in blocks of 2 x 2."""
    side = seen.shape[0] // 2
    out = np.zeros(len(remembered))
    for k, shape in enumerate(remembered):
        for y in range(side):
            for x in range(side):
                block = np.s_[2 * y : 2 * y + 2, 2 * x : 2 * x + 2]
                out[k] += max(0, int(seen[block].sum()) - int(shape[block].sum()))
    return out


def expected_distances(
    seen: Mask, remembered: Mask, phi: Array, softness: tuple[float, float], least: float
) -> Array:
    """(N, N) mean of the distances phi (K, N, N), by exp(-sticks out / softness), where that is at least `least`."""
    out = sticks_out(seen, remembered)
    width = softness[0] + softness[1] * out.min()
    weights = np.exp((out.min() - out) / width)
    weights[weights < least] = 0
    return np.asarray(np.einsum("k,kyx->yx", weights / weights.sum(), phi))
