# SPDX-License-Identifier: MIT
"""The measures of one repetition, each with its interval."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Context, Definition
from sdftrack.motion.intervals import Measured, measured
from sdftrack.motion.posterior import SmoothedMotion
from sdftrack.motion.quaternion_curves import angles_between
from sdftrack.motion.repetitions import Repetition
from sdftrack.motion.samples import MARGIN_S, MotionSamples, with_rests

Array = NDArray[np.float64]
OF_TURNS = frozenset({"range_angle", "range_turn", "peak_angular_speed"})
OF_TILTS = frozenset({"max_tilt", "mean_tilt"})
LARGEST_TURN_SD_RAD = 0.3  # beyond it angles saturate, and their intervals are too narrow
UNSEEN = (
    "the rotation is not seen well enough: the object looks alike from several sides; track its colours too"
)
RATE_HZ = 100.0  # of the samples that measures are computed from


@dataclass(frozen=True, eq=False)
class MeasuredRepetition:
    """A repetition and its measures.

    Attributes
    ----------
    span : Repetition
    values : dict of str to Measured
        Measures of the whole repetition by name; those of a movement end in "_move" (the first one) and "_return" (the
        last one, if the object was held in between).
    gap_s : float
        Time in it without a measured pose, s.
    cue_s : float or None
        The signal that it belongs to.
    """

    span: Repetition
    values: dict[str, Measured]
    gap_s: float
    cue_s: float | None = None
    # Of the mean movement and of the samples, before any correction: an average is corrected once, too.
    raw: dict[str, float] = field(default_factory=dict, repr=False)
    spread: dict[str, Array] = field(default_factory=dict, repr=False)


def requests(
    motion: SmoothedMotion,
    repetition: Repetition,
    cue_s: float | None,
    shared: dict[str, Any],
    definitions: list[Definition],
) -> tuple[Array, list[tuple[Definition, str, Context]]]:
    """What is computed for a repetition: regular times, and each measure with its name and context."""
    first, last = motion.trajectory.times_s[[0, -1]]
    start = max(first, min(repetition.start_s, cue_s if cue_s is not None else np.inf) - MARGIN_S)
    times = start + np.arange(int((min(last, repetition.end_s + MARGIN_S) - start) * RATE_HZ) + 1) / RATE_HZ
    movements = tuple((p.start_s, p.end_s) for p in repetition.movements)
    asked = []
    for definition in definitions:
        for suffix, a, b in _stretches(definition, repetition):
            span = max(a, float(times[0])), min(b, float(times[-1]))
            asked.append(
                (definition, definition.name + suffix, Context(*span, cue_s, movements=movements, **shared))
            )
    return times, asked


def measure_repetition(
    motion: SmoothedMotion,
    repetition: Repetition,
    cue_s: float | None,
    shared: dict[str, Any],
    definitions: list[Definition],
) -> MeasuredRepetition:
    times, asked = requests(motion, repetition, cue_s, shared, definitions)
    mean, samples = motion.mean(times), motion.samples(times)
    unseen = _unseen(mean, samples, shared["axis_obj"])
    values: dict[str, Measured] = {}
    raw: dict[str, float] = {}
    spread: dict[str, Array] = {}
    for definition, name, context in asked:
        spread[name] = definition.compute(samples, context)
        raw[name] = float(definition.compute(mean, context)[0])
        values[name] = measured(definition, raw[name], spread[name], name)
        if definition.name in unseen:
            values[name] = dataclasses.replace(values[name], determined=False, note=UNSEEN)
    inside = (times >= repetition.start_s) & (times <= repetition.end_s)
    gap = float(np.sum(~mean.observed[inside]) / RATE_HZ)
    return MeasuredRepetition(repetition, values, gap, cue_s, raw, spread)


def _unseen(mean: MotionSamples, samples: MotionSamples, axis_obj: Array) -> frozenset[str]:
    """The measures of what is not known to 0.3 rad: of the rotation, or of the direction of the upright axis.

    A can's print may not show how it is turned, while its axis is known.
    """
    some = np.flatnonzero(mean.observed)[::10]
    if not len(some):
        return frozenset()
    turned, center = samples.rotations[:, some], mean.rotations[0, some]
    turns = angles_between(turned, center)
    tilts = np.arccos(np.clip(((turned @ axis_obj) * (center @ axis_obj)).sum(axis=-1), -1, 1))
    out: frozenset[str] = frozenset()
    for angles, names in ((turns, OF_TURNS), (tilts, OF_TILTS)):
        if np.sqrt((angles**2).mean()) > LARGEST_TURN_SD_RAD:
            out |= names
    return out


def _stretches(definition: Definition, repetition: Repetition) -> list[tuple[str, float, float]]:
    """(suffix, start, end) of what a measure is computed for."""
    if definition.of == "repetition":
        return [("", repetition.start_s, repetition.end_s)]
    movements = [(p.start_s, p.end_s) for p in repetition.movements]
    out = [("_move", *with_rests(movements, 0))]
    if len(movements) > 1:
        out.append(("_return", *with_rests(movements, len(movements) - 1)))
    return out
