# SPDX-License-Identifier: MIT
"""Measures of a movement: name, unit, definition, source and function of each; their values with 95 % intervals."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.report_file import plain
from sdftrack.motion.posterior import MotionSamples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Context:
    """What a measure may need besides the movement."""

    # `start_s` to `end_s` is the repetition, or the whole trajectory; the samples may extend beyond it. `cue_s` is the
    # time of the signal to start, `up` the unit vector against gravity in the reference frame, `axis_obj` the axis of
    # the object that is upright when a vessel stands; `movements` are the stretches (start, end) in which the object
    # moves, none: all of the repetition.

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
ROWS: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("measures").joinpath("definitions.toml").read_text("utf-8")
)


def measure(name: str, *, beyond: bool = False) -> Callable[[Compute], Compute]:
    """Register a function as the measure `name`; `beyond`: it also takes the samples around the repetition."""

    def register(f: Compute) -> Compute:
        row = {**ROWS[name]}
        row["source"] = row["source"].format(**ROWS["sources"])
        relative = "part" in row
        wide, compute = row.pop("part" if relative else "wide"), f if beyond else on_repetition(f)
        DEFINITIONS[name] = Definition(name=name, wide=wide, relative=relative, compute=compute, **row)
        return compute

    return register


def undefined(samples: MotionSamples) -> Array:
    """(S,) NaN."""
    return np.full(len(samples.positions_m), np.nan)


def on_repetition(compute: Compute) -> Compute:
    """Passes only the samples from `context.start_s` to `context.end_s` to a measure."""
    # The measure is NaN where that part has fewer than two samples or a gap: what was not seen may be the longest path
    # and the largest angle, so no part of the repetition stands for all of it.

    def computed(samples: MotionSamples, context: Context) -> Array:
        part = samples.between(context.start_s, context.end_s)
        if len(part.times_s) < 2 or not part.observed.all():
            return undefined(samples)
        return compute(part, context)

    return computed


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
    """`value` of the mean movement with the spread of the values of the posterior's samples."""
    # Lengths and jerks of the samples are larger than those of their mean, as their noise adds to them; the interval is
    # therefore the distribution of the samples shifted so that its median is the value of the mean movement, less the
    # part of the shift that this value has, too (`Definition.bias`).
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
