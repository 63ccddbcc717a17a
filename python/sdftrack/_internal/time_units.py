# SPDX-License-Identifier: MIT
"""The unit of times in files, which say none: found from the steps between them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

UNITS = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}  # per second
LONGEST_STEP_S = 1.0  # between frames, of a unit other than seconds
LONGEST_IN_S = 5.0  # seconds are what formats define: a slow recording stays one
EPOCH_S, LONGEST_EPOCH_STEP_S = (
    (1e9, 4e9),
    600.0,
)  # times since 1970, in 2001 to 2096, tell their unit themselves


def in_seconds(times: Sequence[Any] | NDArray[Any], name: str) -> NDArray[np.float64]:
    """Times (N,) of successive frames in seconds, with a warning that names the file and the unit if it is another.

    Whole numbers are divided as such: nanoseconds since 1970 have more digits than a float64.
    """
    values = list(times)
    unit = _unit(np.array(values, np.float64))
    if unit == "s":
        return np.array(values, np.float64)
    warnings.warn(f"{name}: the times are read as {unit}, by the step between them", stacklevel=6)
    return np.array([value / UNITS[unit] for value in values], np.float64)


def _unit(times: NDArray[np.float64]) -> str:
    steps = np.abs(np.diff(times))
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    middle = abs(float(np.median(times))) if len(times) else 0.0
    for unit, per_s in UNITS.items():
        longest = LONGEST_EPOCH_STEP_S if unit == "s" else LONGEST_STEP_S
        if EPOCH_S[0] <= middle / per_s < EPOCH_S[1] and step <= longest * per_s:
            return unit
    if step <= LONGEST_IN_S:
        return "s"
    return next((unit for unit, n in UNITS.items() if n > 1 and step <= LONGEST_STEP_S * n), "ns")
