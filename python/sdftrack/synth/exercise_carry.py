# SPDX-License-Identifier: MIT
"""How a person carries an object: lifts, submovements, tilts and tremor, in the table's frame (m, s, rad)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sdftrack.synth.exercise_signals import ObjectMotion, Oscillation, Signal, Steps, Turn

Array = NDArray[np.float64]
Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Person:
    """Habits of who exercises, constant over the repetitions."""

    reaction_s: float
    pause_s: float
    move_s: float
    hold_s: float
    lift_m: float
    parts: int  # submovements
    overlap: float  # 1: one after the other; 2: each begins halfway through the one before
    bow_m: float
    axis: tuple[float, float, float]  # horizontal, of tilting
    lean_rad: float  # while carrying
    yaw_rad: float

    @classmethod
    def random(cls, rng: np.random.Generator, parts: int | None, lift_m: tuple[float, float]) -> Person:
        about = rng.uniform(0, 2 * np.pi)
        return cls(
            reaction_s=rng.uniform(0.25, 0.6),
            pause_s=rng.uniform(0.6, 1.2),
            move_s=rng.uniform(1.4, 2.6),
            hold_s=rng.uniform(0.6, 1.4),
            lift_m=rng.uniform(*lift_m),
            parts=int(rng.integers(1, 5)) if parts is None else parts,
            overlap=rng.uniform(1.15, 2.0),
            bow_m=rng.uniform(0.0, 0.025),
            axis=(float(np.cos(about)), float(np.sin(about)), 0.0),
            lean_rad=rng.uniform(0.0, 0.15),
            yaw_rad=rng.uniform(-0.7, 0.7),
        )

    def upright(self) -> Person:
        """One who turns the object in no direction while carrying it."""
        return replace(self, lean_rad=0.0, yaw_rad=0.0)

    def other_hand(self, rng: np.random.Generator, parts: int | None) -> Person:
        """The same times and heights, but other submovements."""
        parts = self.parts + int(rng.integers(0, 2)) if parts is None else parts
        return replace(self, parts=parts, overlap=rng.uniform(1.15, 2.0), bow_m=rng.uniform(0.0, 0.025))


def submovements(
    by: Array, start: float, end: float, parts: int, overlap: float, bow_m: float, rng: np.random.Generator
) -> Steps:
    """A displacement in `parts` overlapping steps that deviate sideways and whose deviations cancel out."""
    spacing = (end - start) / (parts - 1 + overlap)
    spans = tuple((start + k * spacing, start + (k + overlap) * spacing) for k in range(parts - 1))
    spans += ((end - overlap * spacing, end),)  # exactly at the end
    share = rng.uniform(0.6, 1.4, parts) / np.arange(1, parts + 1) ** 0.5  # the first ones go farther
    sizes = np.outer(share / share.sum(), by)
    if parts > 1:
        aside = rng.normal(size=parts)
        sizes += bow_m * np.outer(aside - aside.mean(), _beside(by))
    return Steps(spans, tuple(tuple(float(x) for x in size) for size in sizes))


def _beside(by: Array) -> Array:
    """Horizontal unit vector across a displacement."""
    across = np.array([-by[1], by[0], 0.0])
    length = float(np.linalg.norm(across))
    return across / length if length > 0 else np.array([1.0, 0.0, 0.0])


@dataclass
class Carry:
    """An object that is carried away and back, repetition by repetition."""

    person: Person
    home: Array  # where it stands
    rng: np.random.Generator
    yaw_rad: float = 0.0  # how it stands
    grip_m: float = 0.0  # where it is held, above its origin
    moves: list[Signal] = field(default_factory=list)
    yaw: list[Signal] = field(default_factory=list)
    tilt: list[Signal] = field(default_factory=list)
    wobble: list[Signal] = field(default_factory=list)
    tilted_rad: float = 0.0
    at: Array = field(init=False)

    def __post_init__(self) -> None:
        self.at = self.home.copy()

    def go(self, target: Array, start: float, end: float) -> None:
        """Lift the object and carry it above a place on the table; it rises first."""
        p, span = self.person, end - start
        self.lift(p.lift_m, start, start + 0.6 * span)
        self._across(target, start + 0.12 * span, end)
        self.yaw.append(Steps(((start + 0.12 * span, end),), ((p.yaw_rad,),)))
        self._lean(start + 0.1 * span, end)

    def back(self, target: Array, start: float, end: float) -> None:
        """Carry it to a place on the table and put it down there; it sinks last."""
        p, span = self.person, end - start
        self._across(target, start, end - 0.12 * span)
        self.lift(-p.lift_m, start + 0.4 * span, end)
        self.yaw.append(Steps(((start, end - 0.12 * span),), ((-p.yaw_rad,),)))
        self._lean(start, end - 0.1 * span)

    def lift(self, by_m: float, start: float, end: float) -> None:
        self.moves.append(Steps(((start, end),), ((0.0, 0.0, by_m),)))

    def pour(self, by_rad: float, start: float, end: float) -> None:
        """Tilt it about where it is held, so that its origin moves, too."""
        (x, y, _), c, s = self.person.axis, np.cos(self.person.yaw_rad), np.sin(self.person.yaw_rad)
        aside = np.array([c * y + s * x, s * y - c * x, 0.0])  # where the upright axis of the object tilts to
        was, now = self.tilted_rad, self.tilted_rad + by_rad
        move = -self.grip_m * (
            (np.sin(now) - np.sin(was)) * aside + (np.cos(now) - np.cos(was)) * np.array(Z)
        )
        self.moves.append(Steps(((start, end),), (tuple(float(v) for v in move),)))
        self.tilt.append(Steps(((start, end),), ((by_rad,),)))
        self.tilted_rad = now

    def _across(self, target: Array, start: float, end: float) -> None:
        p = self.person
        self.moves.append(submovements(target - self.at, start, end, p.parts, p.overlap, p.bow_m, self.rng))
        self.at = target

    def _lean(self, start: float, end: float) -> None:
        half = 0.5 * (start + end)
        lean = self.person.lean_rad
        self.tilt.append(Steps(((start, half), (half, end)), ((lean,), (-lean,))))

    def tremble(self, start: float, end: float, hz: float, amplitude_m: float, amplitude_rad: float) -> None:
        """Tremor while it is held, and a slow drift of the hand."""
        rng, ramp = self.rng, min(0.6, 0.4 * (end - start))
        along, other = _two_directions(rng)
        depth, slow = rng.uniform(0.15, 0.3), rng.uniform(0.1, 0.3)

        def waves(hz: float, amplitudes: Array, lag: float) -> Oscillation:
            sizes = tuple(float(a) for a in amplitudes)
            return Oscillation(start, end, ramp, hz, sizes, (lag,) * len(sizes), depth, slow)

        self.moves += [waves(hz, amplitude_m * along, 0.0), waves(hz, 0.3 * amplitude_m * other, np.pi / 2)]
        self.wobble.append(waves(hz, np.array([amplitude_rad]), rng.uniform(0, 2 * np.pi)))
        self.moves.append(waves(rng.uniform(0.25, 0.6), rng.normal(size=3) * 0.0015, 0.0))

    def motion(self) -> ObjectMotion:
        wobble_axis = _two_directions(self.rng)[0]
        turns = [
            Turn(Z, tuple(self.yaw)),
            Turn(self.person.axis, tuple(self.tilt)),
            Turn(tuple(wobble_axis), tuple(self.wobble)),
            Turn(Z, (), self.yaw_rad),
        ]
        x, y, z = (float(v) for v in self.home)
        return ObjectMotion((x, y, z), tuple(self.moves), tuple(turns))


def _two_directions(rng: np.random.Generator) -> tuple[Array, Array]:
    """Two unit vectors at right angles."""
    a, b = rng.normal(size=(2, 3))
    a /= np.linalg.norm(a)
    b -= (a @ b) * a
    return a, b / np.linalg.norm(b)
