# SPDX-License-Identifier: MIT
"""Measures of a movement: name, unit, definition and source beside the function that computes each of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.samples import MotionSamples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Context:
    """What a measure may need besides the movement.

    `start_s` to `end_s` is the repetition, or the whole trajectory; the samples may extend beyond it. `cue_s` is the
    time of the signal to start, `up` the unit vector against gravity in the reference frame, `axis_obj` the axis of the
    object that is upright when a vessel stands; `movements` are the stretches (start, end) in which the object moves,
    none: all of the repetition.
    """

    start_s: float
    end_s: float
    cue_s: float | None = None
    up: Array | None = None
    axis_obj: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    movements: tuple[tuple[float, float], ...] = ()


Compute = Callable[[MotionSamples, Context], Array]


def of_two_objects(samples: MotionSamples, context: Context) -> Array:
    """In place of the function of a measure that no object has alone."""
    raise NotImplementedError("computed for two objects")


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
    of : "repetition" or "movement"
        What it is computed for: all of a repetition, or each of its movements between two rests.
    signed : bool
        Whether values below 0 have a meaning although the unit is one of lengths, times or angles.
    bias : float
        Noise makes the largest of many values larger, and a path longer: the values of the samples differ from that of
        their mean by a shift, and the mean movement itself, which has noise left, from the true one by about this part
        of that shift. It is taken off.
    spread : float
        Factor of the posterior's spread, chosen on synthetic exercises (docs/results/motion.md) where the samples of
        the prior are rougher than people's movements.
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
    compute: Compute = of_two_objects
    of: str = "repetition"
    signed: bool = False
    bias: float = 0.0
    spread: float = 1.0


DEFINITIONS: dict[str, Definition] = {}


def measure(
    name: str,
    label: str,
    unit: str,
    text: str,
    source: str,
    *,
    wide: float | None = None,
    part: float = 0.0,
    of: str = "repetition",
    beyond: bool = False,
) -> Callable[[Compute], Compute]:
    """Register a function as the measure `name`.

    An interval is "not determined" if it is wider than `wide`, in the measure's unit, or than the `part` of the value.
    `beyond`: the function also takes the samples before and after the repetition.
    """

    def register(f: Compute) -> Compute:
        bias, spread = CALIBRATION.get(name, (0.0, 1.0))
        limit, compute = part if wide is None else wide, f if beyond else on_repetition(f)
        DEFINITIONS[name] = Definition(
            name, label, unit, text, source, limit, wide is None, compute, of, bias=bias, spread=spread
        )
        return compute

    return register


def undefined(samples: MotionSamples) -> Array:
    """(S,) NaN."""
    return np.full(len(samples.positions_m), np.nan)


def on_repetition(compute: Compute) -> Compute:
    """Passes only the samples from `context.start_s` to `context.end_s` to a measure.

    The measure is NaN where that part has fewer than two samples or a gap: what was not seen may be the longest path
    and the largest angle, so no part of the repetition stands for all of it.
    """

    def computed(samples: MotionSamples, context: Context) -> Array:
        part = samples.between(context.start_s, context.end_s)
        if len(part.times_s) < 2 or not part.observed.all():
            return undefined(samples)
        return compute(part, context)

    return computed


# Measure: (part of the samples' shift that the mean movement has, too; factor of the spread).
CALIBRATION: dict[str, tuple[float, float]] = {
    "path_length": (0.9, 2.1),
    "index_of_curvature": (0.0, 0.9),
    "sparc": (0.0, 1.05),
    "log_dimensionless_jerk": (0.2, 1.1),
    "peak_speed": (0.2, 1.0),
    "peak_acceleration": (0.2, 1.0),
    "peak_angular_speed": (0.5, 1.05),
    "range_height": (1.0, 1.15),
    "range_horizontal": (1.1, 1.25),
    "range_turn": (1.5, 1.35),
    "range_angle": (0.6, 0.85),
    "range_x": (0.5, 1.2),
    "range_y": (0.7, 1.0),
    "range_z": (0.6, 0.9),
    "reach": (0.2, 1.05),
    "movement_time": (0.0, 0.8),
    "reaction_time": (0.0, 0.9),
    "repetition_time": (0.0, 0.8),
    "time_to_peak_speed_part": (0.0, 1.1),
    "max_tilt": (1.4, 0.95),
    "mean_tilt": (0.2, 1.1),
    "dwell_time": (0.1, 1.6),
}
