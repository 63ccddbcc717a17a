# SPDX-License-Identifier: MIT
"""Stretches of time in which something holds: contacts, stays in a zone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_opening

__all__ = ["MIN_S", "beginnings", "settled"]

Mask = NDArray[np.bool_]
MIN_S = 0.1  # noise at a threshold makes many short stretches of one


def settled(holds: Mask, rate_hz: float, min_s: float = MIN_S) -> Mask:
    """(S, n) `holds` without breaks and then without stretches that are shorter than `min_s`.

    A stretch or break at either end of the recording stays: how long it goes on beyond is not known.
    """
    count = max(1, round(min(min_s * rate_hz, holds.shape[1] + 1)))  # what is longer than all is no different
    beyond = 3 * count  # both filters take something off the ends
    wide = np.pad(holds, ((0, 0), (beyond, beyond)), mode="edge")
    window = np.ones((1, count), dtype=bool)
    done = binary_opening(binary_closing(wide, window), window)
    return np.asarray(done[:, beyond:-beyond])


def beginnings(holds: Mask) -> Mask:
    """(S, n) True at the first sample of each stretch."""
    before = np.pad(holds, ((0, 0), (1, 0)))[:, :-1]
    return np.asarray(holds & ~before)
