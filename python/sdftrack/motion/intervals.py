# SPDX-License-Identifier: MIT
"""A measured value with its 95 % interval, and whether it tells anything."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.report_file import plain
from sdftrack.motion.definitions import Definition

Array = NDArray[np.float64]
LEVEL = (2.5, 97.5)
TOO_WIDE = "the interval is too wide: move nearer, record more frames per second, or use a larger object"
NOISE_ALONE = 0.2  # of the value, as the shift of the samples; of noise alone it is sqrt(2) - 1
SEVERAL = "several movements fit the poses: correct the repetitions, or record more frames per second"
APART = 0.8  # of half of an interval: the value of the mean movement is not that of the samples
LEAST_DEFINED = 0.9  # of the samples


@dataclass(frozen=True)
class Measured:
    """The value of a measure.

    Attributes
    ----------
    name, unit : str
    value, low, high : float
        Of the smoothed movement, and the 95 % interval; NaN where undefined.
    determined : bool
        The interval is narrow enough to tell something.
    note : str
        "", or why it is not determined and what would help.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    determined: bool
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Ready for JSON: null where undefined."""
        return dict(plain(dataclasses.asdict(self)))


def measured(definition: Definition, value: float, samples: Array, name: str | None = None) -> Measured:
    """`value` of the mean movement with the spread of the values of the posterior's samples.

    Lengths and jerks of the samples are larger than those of their mean, as their noise adds to them; the interval is
    therefore the distribution of the samples shifted so that its median is the value of the mean movement, less the
    part of the shift that this value has, too (`Definition.bias`).
    """
    known = np.isfinite(samples)
    if not np.isfinite(value) or known.mean() < LEAST_DEFINED:
        nan = float("nan")
        note = "undefined here" if not known.any() else "undefined in many of the possible movements"
        return Measured(name or definition.name, definition.unit, nan, nan, nan, False, note)
    # As np.percentile, whose checks take longer than the sort.
    at = np.array([LEVEL[0], 50, LEVEL[1]]) * (0.01 * (known.sum() - 1))
    low, middle, high = np.interp(at, np.arange(known.sum()), np.sort(samples[known])).tolist()
    side = high - middle if value > middle else middle - low
    if not definition.bias and abs(value - middle) > APART * side + 1e-12:
        # The samples and their mean disagree on which movement this is: no shift makes one of the other.
        low, high = float(min(value, low)), float(max(value, high))
        return Measured(name or definition.name, definition.unit, float(value), low, high, False, SEVERAL)
    noise_alone = middle - value > NOISE_ALONE * abs(value) and value >= 0
    value -= definition.bias * (middle - value)
    never_negative = definition.unit != "1" and not definition.signed  # lengths, times and angles
    if never_negative:
        value = max(value, 0.0)
    low, high = value + definition.spread * (low - middle), value + definition.spread * (high - middle)
    if never_negative:
        # A range or tilt of zero would look the same as noise alone.
        low = 0.0 if definition.bias and noise_alone else max(low, 0.0)
    limit = definition.wide * (abs(value) if definition.relative else 1.0)
    fine = bool(high - low <= limit)
    note = "" if fine else TOO_WIDE
    return Measured(
        name or definition.name, definition.unit, float(value), float(low), float(high), fine, note
    )
