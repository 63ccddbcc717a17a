# SPDX-License-Identifier: MIT
"""The part of the samples that a measure is about: the repetition, without gaps."""

from __future__ import annotations

from functools import wraps

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Compute, Context
from sdftrack.motion.samples import MotionSamples

__all__ = ["moving", "on_repetition", "undefined"]

Array = NDArray[np.float64]


def undefined(samples: MotionSamples) -> Array:
    """(S,) NaN."""
    return np.full(len(samples.positions_m), np.nan)


def moving(samples: MotionSamples, context: Context) -> NDArray[np.bool_]:
    """(n,) True in the movements of the repetition; everywhere without any."""
    if not context.movements:
        return np.ones(len(samples.times_s), dtype=bool)
    t = samples.times_s
    return np.any([(t >= a - 1e-9) & (t <= b + 1e-9) for a, b in context.movements], axis=0)


def on_repetition(compute: Compute) -> Compute:
    """Passes only the samples from `context.start_s` to `context.end_s` to a measure.

    The measure is NaN where that part has fewer than two samples or a gap: what was not seen may be the longest path
    and the largest angle, so no part of the repetition stands for all of it.
    """

    @wraps(compute)
    def computed(samples: MotionSamples, context: Context) -> Array:
        part = samples.between(context.start_s, context.end_s)
        if len(part.times_s) < 2 or not part.observed.all():
            return undefined(samples)
        return compute(part, context)

    return computed
