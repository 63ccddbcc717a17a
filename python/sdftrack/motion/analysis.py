# SPDX-License-Identifier: MIT
"""An exercise measured: repetitions, and for each of them every measure with its 95 % interval."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import THREADS, direction, numbers, of_kind, whole
from sdftrack.motion.definitions import DEFINITIONS, Context, Definition, Measured, measured
from sdftrack.motion.measures.repetitions import Tremor, mean_dtw_distance, tremor_of
from sdftrack.motion.measures.targets import definitions_of_target
from sdftrack.motion.posterior import MARGIN_S, MotionSamples, SmoothedMotion, with_rests
from sdftrack.motion.repetitions import Repetition, count_interval, find_repetitions
from sdftrack.motion.smoothing import smooth
from sdftrack.motion.spline import angles_between
from sdftrack.motion.trajectory import Trajectory

Array = NDArray[np.float64]
OF_TURNS = frozenset({"range_angle", "range_turn", "peak_angular_speed"})
OF_TILTS = frozenset({"max_tilt", "mean_tilt"})
LARGEST_TURN_SD_RAD = 0.3  # beyond it angles saturate, and their intervals are too narrow
UNSEEN = (
    "the rotation is not seen well enough: the object looks alike from several sides; track its colours too"
)
RATE_HZ = 100.0  # of the samples that measures are computed from
SETTLED_S = 0.15  # at the ends of a hold, while the object comes to rest


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


@dataclass(frozen=True, eq=False)
class Analysis:
    """What :func:`analyze` finds in the trajectory of one object.

    Attributes
    ----------
    motion : SmoothedMotion
    repetitions : list of MeasuredRepetition
    count : (int, int, int)
        Number of repetitions and its 95 % interval.
    averages : dict of str to Measured
        Of each measure over the repetitions, with the interval of the average.
    variation : dict of str to float
        Coefficient of variation of each measure between repetitions: standard deviation over mean.
    shares : dict of str to float
        Part of the frames per status.
    settings, definitions
        What was asked for.
    """

    motion: SmoothedMotion
    repetitions: list[MeasuredRepetition]
    count: tuple[int, int, int]
    averages: dict[str, Measured]
    variation: dict[str, float]
    shares: dict[str, float]
    settings: dict[str, Any] = field(default_factory=dict, repr=False)
    definitions: list[Definition] = field(default_factory=list, repr=False)

    @property
    def trajectory(self) -> Trajectory:
        return self.motion.trajectory

    @cached_property
    def tremors(self) -> list[tuple[float, float, Tremor]]:
        """(start_s, end_s, tremor) of the holds of a second and more."""
        holds = [(p.start_s, p.end_s) for r in self.repetitions for p in r.span.phases if p.name == "hold"]
        found = [(a, b, self.tremor_between(a + SETTLED_S, b - SETTLED_S)) for a, b in holds]
        return [(a, b, t) for a, b, t in found if t is not None]

    @cached_property
    def path_difference_m(self) -> float:
        """Mean distance of the paths of two repetitions after time warping, m; NaN for fewer than two."""
        paths = [
            self.motion.mean(np.linspace(r.span.start_s, r.span.end_s, 60)).positions_m[0]
            for r in self.repetitions
            if not r.gap_s
        ]
        return mean_dtw_distance(paths)

    def tremor_between(self, start_s: float, end_s: float) -> Tremor | None:
        """The tremor in a stretch of time, see :func:`tremor_of`."""
        return tremor_of(self.trajectory, start_s, end_s, noise_m=self.motion.position_noise_m)

    def requests(self, repetition: MeasuredRepetition) -> tuple[Array, list[tuple[Definition, str, Context]]]:
        """What was computed for a repetition: regular times, and each measure with its name and context."""
        return requests(self.motion, repetition.span, repetition.cue_s, self.settings, self.definitions)


def analyze(
    trajectory: Trajectory | SmoothedMotion,
    *,
    by: str = "auto",
    spans_s: Sequence[tuple[float, float]] | None = None,
    cues_s: ArrayLike = (),
    up: ArrayLike | None = None,
    axis_obj: ArrayLike = (0.0, 0.0, 1.0),
    targets: Sequence[Any] = (),
    measures: Sequence[str] | None = None,
    max_gap_s: float = 0.3,
    samples: int = 200,
    seed: int = 0,
    threads: int = 0,
) -> Analysis:
    """Measure an exercise.

    Parameters
    ----------
    trajectory : Trajectory or SmoothedMotion
        Poses of one object, or the result of :func:`smooth` for them.
    by : "auto", "position" or "rotation"
        What a repetition is found by, see :func:`find_repetitions`.
    spans_s : list of (start, end), optional
        Repetitions set by hand, s.
    cues_s : (K,) array
        Times of the signals to start, s; a repetition belongs to the last one before it.
    up : (3,) array, optional
        Direction against gravity in the reference frame; None: tilt and heights are not measured.
    axis_obj : (3,) array
        Axis of the object that points up when it stands.
    targets : list
        Zones and paths: `Sphere`, `Box`, `Path`.
    measures : list of str, optional
        Names from `DEFINITIONS`; None: all.
    max_gap_s, samples, seed
        See :func:`smooth`.
    threads : int
        0: all cores. The result does not depend on it.

    Raises
    ------
    TypeError, ValueError
        Unknown measure, no direction, spans outside the recording, or what :func:`smooth` raises.
    """
    motion = trajectory
    if not isinstance(motion, SmoothedMotion):
        of_kind(trajectory, Trajectory, "trajectory")
        motion = smooth(trajectory, max_gap_s=max_gap_s, samples=samples, seed=seed)  # type: ignore[arg-type]
    definitions = _chosen(measures)
    for number, target in enumerate(targets, 1):
        definitions += definitions_of_target(target, number)
    first, last = motion.trajectory.times_s[[0, -1]]
    for a, b in spans_s or ():
        if not first - 1e-6 <= a < b <= last + 1e-6:
            raise ValueError(
                f"spans_s: expected start < end within the recording, {first:g} to {last:g} s, got {a:g} to {b:g}"
            )
    context = {"up": None if up is None else direction(up, "up"), "axis_obj": direction(axis_obj, "axis_obj")}
    found = find_repetitions(motion, by=by, spans_s=spans_s)
    cues = np.sort(numbers(cues_s, "cues_s").ravel())
    each = [(r, _cue_of(r, found, cues)) for r in found]
    motion.draw(whole(threads, "threads", 0, what=THREADS))  # once, before threads ask for it
    with ThreadPoolExecutor(_core.thread_count(threads)) as pool:
        counted = None if spans_s is not None else pool.submit(count_interval, motion, by=by)
        done = list(pool.map(lambda a: measure_repetition(motion, a[0], a[1], context, definitions), each))
    counts = (len(found),) * 3 if counted is None else counted.result()
    status = np.array(motion.trajectory.status)
    shares = {name: float(np.mean(status == name)) for name in ("ok", "weak", "lost", "bad_frame")}
    averages, variation = _averages(done, definitions)
    return Analysis(
        motion, done, (len(found), *counts[1:]), averages, variation, shares, context, definitions
    )


def _chosen(measures: Sequence[str] | None) -> list[Definition]:
    if measures is None:
        return list(DEFINITIONS.values())
    unknown = [m for m in measures if m not in DEFINITIONS]
    if unknown:
        raise ValueError(f"measures: expected names of {', '.join(DEFINITIONS)}, got {unknown[0]!r}")
    return [DEFINITIONS[m] for m in measures]


def _cue_of(repetition: Repetition, found: list[Repetition], cues: Array) -> float | None:
    """The last cue before the repetition, if no other repetition started since."""
    before = cues[cues <= repetition.start_s]
    started = [r.start_s for r in found if r.start_s < repetition.start_s]
    return float(before[-1]) if len(before) and (not started or before[-1] > max(started)) else None


def _averages(
    done: list[MeasuredRepetition], definitions: list[Definition]
) -> tuple[dict[str, Measured], dict[str, float]]:
    """Averages over the repetitions in which a measure is defined, and coefficients of variation."""
    names = list(dict.fromkeys(name for r in done for name in r.values))
    by_name = {d.name: d for d in definitions}
    averages, variation = {}, {}
    for name in names:
        rows = [r for r in done if name in r.values and np.isfinite(r.values[name].value)]
        if not rows:
            continue
        values = np.array([r.values[name].value for r in rows])
        each = np.mean([r.spread[name] for r in rows], axis=0)
        definition = by_name.get(name) or by_name[name.rsplit("_", 1)[0]]
        averages[name] = measured(definition, float(np.mean([r.raw[name] for r in rows])), each, name)
        if any(r.values[name].note == UNSEEN for r in rows):
            averages[name] = dataclasses.replace(averages[name], determined=False, note=UNSEEN)
        if len(values) > 1 and values.mean() != 0:
            variation[name] = float(values.std(ddof=1) / abs(values.mean()))
    return averages, variation


# -- The measures of one repetition


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
    """The measures of what is not known to 0.3 rad: of the rotation, or of the direction of the upright axis."""
    # A can's print may not show how it is turned, while its axis is known.
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
