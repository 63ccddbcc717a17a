# SPDX-License-Identifier: MIT
"""Whether the 95 % intervals of the measures of an exercise hold the truth: rendered, tracked, measured."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.exercise.truth import true_values
from experiments.registry import experiment
from experiments.table import Table
from sdftrack import motion
from sdftrack.motion.analysis import Analysis

Array = NDArray[np.float64]
KINDS = ("reach", "pouring", "circle", "tremor", "two_handed")
OBJECTS = ("cup", "ball", "box", "stick", "duck", "can")
NOISES: tuple[tuple[str, Any], ...] = (("1 mm", 0.001), ("Kinect", "kinect"))
REPETITIONS = 3
TOUCHING_M = 0.001  # between two objects that meet
DT = 1e-3  # s, of differences of exact velocities


@dataclass
class Tally:
    """Of one measure: true values with their intervals, and whether they were determined."""

    inside: list[bool] = field(default_factory=list)
    determined: list[bool] = field(default_factory=list)
    half: list[float] = field(default_factory=list)
    error: list[float] = field(default_factory=list)
    unit: str = ""

    def add(self, m: motion.Measured, true: float) -> None:
        if not np.isfinite([m.value, true]).all():
            return
        self.unit = m.unit
        self.inside.append(m.low - 1e-9 <= true <= m.high + 1e-9)
        self.determined.append(m.determined)
        self.half.append(0.5 * (m.high - m.low))
        self.error.append(abs(m.value - true))

    def row(self, name: str) -> list[str]:
        found = np.array(self.determined)
        both = np.array(self.inside)
        inside = f"{100 * both[found].mean():.1f}" if found.any() else ""
        numbers = [np.median(np.array(v)[found]) if found.any() else np.nan for v in (self.error, self.half)]
        return [
            name, self.unit, str(len(both)), f"{100 * found.mean():.0f}", inside, f"{100 * both.mean():.1f}",
            f"{numbers[0]:.2g}", f"{numbers[1]:.2g}",
        ]  # fmt: skip


COLUMNS = [
    "measure", "unit", "values", "determined %", "in interval %", "with the others %", "median error", "half width",
]  # fmt: skip


def tracked_exercise(
    kind: str, name: str, noise: Any, seed: int, voxels: int = 120, threads: int = 1
) -> tuple[Any, list[motion.Trajectory]]:
    """An exercise with the trajectories of its objects, tracked in rendered images from the true first pose."""
    mesh = st.synth.exercise_object(name)
    center = 0.5 * (mesh.bounds[0] + mesh.bounds[1])
    mesh = st.Mesh(mesh.vertices - center, mesh.faces, mesh.colors)
    own: dict[str, Any] = (
        {"meeting_m": float(np.ptp(mesh.bounds[:, 0])) + TOUCHING_M} if kind == "two_handed" else {}
    )
    exercise = st.synth.exercise(kind, seed=seed, repetitions=REPETITIONS, origin_m=float(center[2]), **own)
    seq = st.synth.exercise_sequence(exercise, mesh, noise=noise, seed=seed, threads=threads)
    shape = st.SDF.from_mesh(mesh, voxels=voxels, unit="m")
    tracker = st.Tracker([shape] * exercise.objects, seq.camera, threads=threads)
    results = []
    for i, frame in enumerate(seq):
        first = [exercise.poses([0.0], k)[0] for k in range(exercise.objects)]
        results.append(tracker.start(frame, poses=first) if i == 0 else tracker.track(frame))
    return exercise, [
        motion.Trajectory(
            exercise.times_s,
            np.array([r.poses[k] for r in results]),
            np.array([r.motion_covariances[k] for r in results]),
            [str(r.status[k]) for r in results],
            name=f"{name} {k}",
        )
        for k in range(exercise.objects)
    ]


@experiment(
    "exercise_intervals",
    chosen_on="rendered and tracked exercises of seeds 500 to 599 (spread and bias of the measures)",
    reported_on="rendered and tracked exercises of seeds from 2000 on",
    short={"runs": 1},
)
def exercise_intervals(*, runs: int = 100, first_seed: int = 2000, threads: int = 1) -> list[Table]:
    """Exercises rendered with depth noise, tracked and measured: do the 95 % intervals hold the truth?

    Kinds of exercise, objects and noise change from run to run. The truth is what the same definition gives for the
    exact movement.
    """
    tallies: dict[str, dict[str, Tally]] = {label: {} for label, _ in NOISES}
    counts: dict[str, list[tuple[bool, bool]]] = {label: [] for label, _ in NOISES}
    wrong, floors = [], []
    for run in range(runs):
        kind, name = KINDS[run % len(KINDS)], OBJECTS[(run // len(KINDS)) % len(OBJECTS)]
        label, noise = NOISES[run % len(NOISES)]
        exercise, trajectories = tracked_exercise(kind, name, noise, first_seed + run, threads=threads)
        for k, trajectory in enumerate(trajectories):
            point = motion.best_known_point(trajectory)
            trajectory = motion.at_point(trajectory, point)
            found = motion.analyze(trajectory, cues_s=exercise.cues_s, up=exercise.up)
            true = len(exercise.repetitions)
            counts[label].append((found.count[0] == true, found.count[1] <= true <= found.count[2]))
            if found.count[0] != true:
                wrong.append(f"{kind}, {name}, {label}, seed {first_seed + run}: {found.count[0]} of {true}")
            _compare(found, exercise, k, point, tallies[label])
            floors += _floor(found, exercise)
    tables = [
        Table(
            f"Intervals of the measures, {label}",
            COLUMNS,
            [tally.row(measure) for measure, tally in sorted(by_measure.items()) if tally.inside],
        )
        for label, by_measure in tallies.items()
    ]
    tables.append(_count_table(counts, wrong))
    if floors:
        tables.append(_floor_table(np.array(floors)))
    return tables


def _at(exercise: Any, k: int, point: Array, times: Array) -> motion.MotionSamples:
    """The exact movement of a point of object k."""
    exact = exercise.sample(times, k)
    velocities = _velocities(exact, point)
    after, before = (_velocities(exercise.sample(times + s * DT, k), point) for s in (1, -1))
    return dataclasses.replace(
        exact,
        positions_m=exact.positions_m + exact.rotations @ point,
        velocities_mps=velocities,
        accelerations_mps2=(after - before) / (2 * DT),
        jerks_mps3=(after - 2 * velocities + before) / DT**2,
    )


def _velocities(exact: motion.MotionSamples, point: Array) -> Array:
    return np.asarray(
        exact.velocities_mps + np.cross(exact.angular_velocities_radps, exact.rotations @ point), np.float64
    )


def _compare(found: Analysis, exercise: Any, k: int, point: Array, tallies: dict[str, Tally]) -> None:
    for repetition in found.repetitions:
        true = true_values(found, repetition, lambda times: _at(exercise, k, point, times))
        for name, m in repetition.values.items():
            measure = name.removesuffix("_move").removesuffix("_return")
            tallies.setdefault(measure, Tally()).add(m, true[name])


def _floor(found: Analysis, exercise: Any) -> list[tuple[float, float]]:
    """(stated, found) noise in the tremor band before the first repetition, while the object rests."""
    tremor = found.tremor_between(0.0, exercise.repetitions[0][0] - 0.05)
    if tremor is None:
        return []
    return [(tremor.floor_m, tremor.total_m)]


def _count_table(counts: dict[str, list[tuple[bool, bool]]], wrong: list[str]) -> Table:
    rows = []
    for label, each in counts.items():
        if each:
            right, inside = np.mean(each, axis=0)
            rows.append([label, str(len(each)), f"{100 * right:.1f}", f"{100 * inside:.1f}"])
    return Table("Repetitions counted", ["noise", "objects", "right %", "in interval %"], rows, wrong)


def _floor_table(floors: Array) -> Table:
    ratio = floors[:, 1] / floors[:, 0]
    row = [
        "3-12 Hz", str(len(floors)), f"{1e3 * np.median(floors[:, 0]):.3f}", f"{np.median(ratio):.2f}",
        f"{np.percentile(ratio, 5):.2f} to {np.percentile(ratio, 95):.2f}",
    ]  # fmt: skip
    columns = ["band", "objects at rest", "stated floor mm", "found over stated", "5 to 95 %"]
    return Table("Noise floor of the tremor band", columns, [row])
