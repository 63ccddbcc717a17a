# SPDX-License-Identifier: MIT
"""Remembered silhouettes, slow and obvious: all shapes, all pixels."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Mask: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[np.float64]


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
