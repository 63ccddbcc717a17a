# SPDX-License-Identifier: MIT
"""Measures of a movement: name, unit, definition and source beside the function that computes each of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.samples import MotionSamples

__all__ = ["DEFINITIONS", "Context", "Definition", "measure"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Context:
    """What a measure may need besides the movement.

    Attributes
    ----------
    start_s, end_s : float
        The repetition, or the whole trajectory. The samples may extend beyond it.
    cue_s : float or None
        Time of the signal to start.
    up : (3,) array or None
        Unit vector against gravity in the reference frame.
    axis_obj : (3,) array
        Axis of the object that is upright when a vessel stands.
    targets : list
        Zones and paths.
    """

    start_s: float
    end_s: float
    cue_s: float | None = None
    up: Array | None = None
    axis_obj: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    targets: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Definition:
    """A measure.

    Attributes
    ----------
    name : str
        Identifier, for example "path_length".
    label, unit, text, source : str
        What reports show: name in words, unit, definition in a sentence, where it is defined.
    wide : float
        An interval wider than this is "not determined": in the measure's unit, or with `relative` as a part of its
        value.
    relative : bool
    compute : callable
        (samples, context) -> (S,) values, NaN where undefined.
    """

    name: str
    label: str
    unit: str
    text: str
    source: str
    wide: float
    relative: bool
    compute: Callable[[MotionSamples, Context], Array]


DEFINITIONS: dict[str, Definition] = {}


def measure(
    name: str, label: str, unit: str, text: str, source: str, wide: float, relative: bool = True
) -> Callable[[Callable[[MotionSamples, Context], Array]], Callable[[MotionSamples, Context], Array]]:
    """Register a function as the measure `name`."""

    def register(f: Callable[[MotionSamples, Context], Array]) -> Callable[[MotionSamples, Context], Array]:
        DEFINITIONS[name] = Definition(name, label, unit, text, source, wide, relative, f)
        return f

    return register
