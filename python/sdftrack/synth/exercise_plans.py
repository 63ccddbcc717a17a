# SPDX-License-Identifier: MIT
"""Random plans of exercises, in the table's frame (x right, y away from the camera, z up; m, s, rad)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sdftrack.synth.exercise_motion import Carry, Circle, ObjectMotion, Person, Signal, Steps, Swing, Turn

Array = NDArray[np.float64]
TREMOR_HZ, TREMOR_M = (4.0, 9.0), (0.0005, 0.003)
GRIP_M = 0.05  # above the foot of the object: a cup is tilted about where it is held
LEVER_M = 0.12  # from the joint that trembles to the object: how far it is rotated by a displacement
POUR_S = 0.8  # least duration of tilting


@dataclass(frozen=True)
class Wishes:
    """What the caller fixes; None: random."""

    repetitions: int
    submovements: int | None
    tremor_hz: float | None
    tremor_amplitude_m: float | None
    meeting_m: float
    origin_m: float


@dataclass
class Plan:
    """A whole exercise in the making."""

    motions: tuple[ObjectMotion, ...] = ()
    cues_s: list[float] = field(default_factory=list)
    repetitions: list[tuple[float, float]] = field(default_factory=list)
    phases: list[tuple[str, float, float]] = field(default_factory=list)
    duration_s: float = 0.0
    tremor_hz: float | None = None
    tremor_amplitude_m: float = 0.0
    tremor_amplitude_rad: float = 0.0

    def enter(self, name: str, end: float) -> None:
        """The next phase, which lasts until `end`."""
        self.phases.append((name, self.duration_s, float(end)))
        self.duration_s = float(end)

    def wait(self, person: Person, rng: np.random.Generator) -> float:
        """Rest until the cue and the reaction to it; returns the onset."""
        cue = self.duration_s + _varied(person.pause_s, rng)
        self.cues_s.append(float(cue))
        self.enter("rest", cue + _varied(person.reaction_s, rng, 0.2))
        return self.duration_s

    def set_tremor(self, wishes: Wishes, rng: np.random.Generator, by_default: bool) -> None:
        hz, amplitude, share = rng.uniform(*TREMOR_HZ), rng.uniform(*TREMOR_M), rng.uniform(0.4, 1.0)
        chosen = wishes.tremor_amplitude_m
        if chosen is None:
            chosen = amplitude if by_default or wishes.tremor_hz is not None else 0.0
        if chosen > 0:
            self.tremor_hz = float(hz if wishes.tremor_hz is None else wishes.tremor_hz)
            self.tremor_amplitude_m = float(chosen)
            self.tremor_amplitude_rad = float(share * chosen / LEVER_M)


def _varied(value: float, rng: np.random.Generator, spread: float = 0.1) -> float:
    return float(value * rng.uniform(1 - spread, 1 + spread))


def _near(place: Array, rng: np.random.Generator, spread_m: float = 0.006) -> Array:
    """A place on the table that is missed by a few millimetres."""
    return place + spread_m * np.append(rng.uniform(-1, 1, 2), 0)


def _carried(
    wishes: Wishes,
    rng: np.random.Generator,
    distance_m: tuple[float, float],
    lift_m: tuple[float, float],
    trembles: bool,
    at_target: Callable[[Plan, Carry, float], float],
) -> Plan:
    """Away, `at_target` (which returns the end of the phase "hold"), and back, repeated."""
    plan, person = Plan(), Person.random(rng, wishes.submovements, lift_m)
    plan.set_tremor(wishes, rng, trembles)
    direction = rng.uniform(0, 2 * np.pi)
    by = rng.uniform(*distance_m) * np.array([np.cos(direction), np.sin(direction), 0.0])
    middle = np.append(rng.uniform(-0.03, 0.03, 2), wishes.origin_m)
    carry = Carry(person, middle - 0.5 * by, rng, rng.uniform(-np.pi, np.pi), GRIP_M - wishes.origin_m)
    for _ in range(wishes.repetitions):
        onset = plan.wait(person, rng)
        plan.enter("move", onset + _varied(person.move_s, rng))
        carry.go(_near(middle + 0.5 * by, rng), onset, plan.duration_s)
        start = plan.duration_s
        plan.enter("hold", at_target(plan, carry, start))
        if plan.tremor_hz is not None:
            carry.tremble(
                start, plan.duration_s, plan.tremor_hz, plan.tremor_amplitude_m, plan.tremor_amplitude_rad
            )
        left = plan.duration_s
        plan.enter("return", left + _varied(person.move_s, rng))
        carry.back(_near(middle - 0.5 * by, rng), left, plan.duration_s)
        plan.repetitions.append((onset, plan.duration_s))
    plan.enter("rest", plan.duration_s + _varied(person.pause_s, rng))
    plan.motions = (carry.motion(),)
    return plan


def reach(wishes: Wishes, rng: np.random.Generator) -> Plan:
    """Carried 0.2-0.4 m, held, carried back."""
    return _carried(
        wishes, rng, (0.2, 0.4), (0.06, 0.14), False,
        lambda plan, carry, start: start + _varied(carry.person.hold_s, rng),
    )  # fmt: skip


def pouring(wishes: Wishes, rng: np.random.Generator) -> Plan:
    """Carried, tilted by 60-110 degrees, held, tilted back, carried back; "hold" begins and ends upright."""
    tilt, seconds = np.radians(rng.uniform(60, 110)), rng.uniform(POUR_S, 1.4)

    def pour(plan: Plan, carry: Carry, start: float) -> float:
        angle = _varied(tilt, rng, 0.04)
        held = start + _varied(seconds, rng)
        again = held + _varied(carry.person.hold_s, rng)
        end = again + _varied(seconds, rng)
        carry.pour(angle, start, held)
        carry.pour(-angle, again, end)
        return end

    return _carried(wishes, rng, (0.15, 0.3), (0.13, 0.17), False, pour)


def tremor(wishes: Wishes, rng: np.random.Generator) -> Plan:
    """Lifted, held for 4-7 s with a tremor, put back."""
    seconds = rng.uniform(4.0, 7.0)
    return _carried(
        wishes, rng, (0.03, 0.12), (0.08, 0.16), True, lambda plan, carry, start: start + _varied(seconds, rng),
    )  # fmt: skip


def circle(wishes: Wishes, rng: np.random.Generator) -> Plan:
    """Circles drawn on the table without a pause; one cue."""
    plan, person = Plan(), Person.random(rng, wishes.submovements, (0.06, 0.14))
    onset = plan.wait(person, rng)
    period, radius = rng.uniform(1.6, 2.8), rng.uniform(0.06, 0.11)
    periods = period * rng.uniform(0.9, 1.1, wishes.repetitions)
    sense = rng.choice([-1.0, 1.0])
    starts = onset + np.append(0.0, np.cumsum(periods))
    # A step of a turn begins at each of the `starts` and takes two periods, so that the speed never sinks much.
    ends = np.append(starts[2:], starts[-1] + periods[-1])
    spans = tuple((float(a), float(b)) for a, b in zip(starts[:-1], ends, strict=True))
    angle = Steps(spans, ((sense * 2 * np.pi,),) * wishes.repetitions)
    plan.enter("move", spans[-1][1])
    crossings = _crossings(angle, onset, plan.duration_s, wishes.repetitions)
    plan.repetitions = [(float(a), float(b)) for a, b in pairwise(crossings)]
    plan.enter("rest", plan.duration_s + _varied(person.pause_s, rng))
    shares, phases = rng.uniform(0.01, 0.04, 3).tolist(), rng.uniform(0, 6.28, 3).tolist()
    uneven = tuple(zip(shares, (0.37, 1.62, 3.0), phases, strict=True))
    path = Circle(angle, (radius, radius * rng.uniform(0.85, 1.0)), rng.uniform(0, 2 * np.pi), uneven)
    start = path.arm()
    turns = (Turn((0.0, 0.0, 1.0), (Swing(angle, rng.uniform(0.05, 0.3)),), rng.uniform(-np.pi, np.pi)),)
    plan.motions = (ObjectMotion((float(start[0]), float(start[1]), wishes.origin_m), (path,), turns),)
    return plan


def _crossings(angle: Signal, start: float, end: float, count: int) -> Array:
    """When each of `count` turns begins, and the end of the last one."""
    out = np.linspace(start, end, count + 1)
    for k in range(1, count):
        low, high = start, end
        for _ in range(60):
            middle = 0.5 * (low + high)
            done = abs(angle(np.array([middle]))[0, 0, 0]) >= 2 * np.pi * k
            low, high = (low, middle) if done else (middle, high)
        out[k] = high
    return out


def two_handed(wishes: Wishes, rng: np.random.Generator) -> Plan:
    """Two objects are carried to the middle, touch there, and are carried back; the hands differ."""
    plan, person = Plan(), Person.random(rng, wishes.submovements, (0.06, 0.12)).upright()
    other = person.other_hand(rng, wishes.submovements)
    apart, away = rng.uniform(0.32, 0.42) + wishes.meeting_m, rng.uniform(-0.05, 0.05)
    lag = rng.uniform(0.05, 0.25)
    late = int(rng.integers(2))
    home, meet = (
        [np.array([side * wide / 2, away, wishes.origin_m]) for side in (-1, 1)]
        for wide in (apart, wishes.meeting_m)
    )
    carries = [Carry(p, at, rng) for p, at in zip((person, other), home, strict=True)]
    for _ in range(wishes.repetitions):
        onset = plan.wait(person, rng)
        plan.enter("move", onset + _varied(person.move_s, rng))
        touching = plan.duration_s
        plan.enter("hold", touching + _varied(person.hold_s, rng))
        parting = plan.duration_s
        plan.enter("return", parting + _varied(person.move_s, rng))
        for k, carry in enumerate(carries):
            late_s = lag * rng.uniform(0.7, 1.3) if k == late else 0.0
            carry.go(meet[k], onset + late_s, touching)
            carry.back(_near(carry.home, rng), parting, plan.duration_s - late_s)
        plan.repetitions.append((onset, plan.duration_s))
    plan.enter("rest", plan.duration_s + _varied(person.pause_s, rng))
    plan.motions = tuple(carry.motion() for carry in carries)
    return plan


PLANS: dict[str, Callable[[Wishes, np.random.Generator], Plan]] = {
    plan.__name__: plan for plan in (reach, pouring, circle, tremor, two_handed)
}
