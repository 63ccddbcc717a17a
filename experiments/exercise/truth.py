# SPDX-License-Identifier: MIT
"""The measures of a known movement over the repetitions that were found: what intervals are compared with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.analysis import Analysis, MeasuredRepetition
from sdftrack.motion.posterior import MotionSamples

Array = NDArray[np.float64]


def true_values(
    found: Analysis, repetition: MeasuredRepetition, movement: Callable[[Array], MotionSamples]
) -> dict[str, float]:
    """Each measure of a repetition, by the same definition and in the same stretch of time, for an exact movement.

    Parameters
    ----------
    found : Analysis
    repetition : MeasuredRepetition
        One of its repetitions.
    movement : callable
        Times (n,) in s -> `MotionSamples` with S = 1, for example `Exercise.sample`.

    Returns
    -------
    dict of str to float
        By the names of `repetition.values`; NaN where undefined.
    """
    times, asked = found.requests(repetition)
    exact = movement(times)
    return {name: float(definition.compute(exact, context)[0]) for definition, name, context in asked}
