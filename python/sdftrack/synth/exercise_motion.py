# SPDX-License-Identifier: MIT
"""How a person carries an object, in the table's frame (m, s, rad): signals with exact derivatives, submovements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Signal = Callable[[Array], Array]


def smooth_step(times: Array, start: float, end: float) -> Array:
    """(4, n): from 0 to 1 with minimum snap, so that the jerk, too, is continuous (minimum jerk lets it jump)."""
    width = end - start
    u = np.clip((times - start) / width, 0, 1)
    rest = 1 - u
    return np.stack(
        [
            u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3),
            140 * (u * rest) ** 3 / width,
            420 * (u * rest) ** 2 * (1 - 2 * u) / width**2,
            840 * u * rest * (1 - 5 * u + 5 * u**2) / width**3,
        ]
    )


def product(a: Array, b: Array) -> Array:
    """Value and derivatives of a product (Leibniz)."""
    return np.stack(
        [
            a[0] * b[0],
            a[1] * b[0] + a[0] * b[1],
            a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2],
            a[3] * b[0] + 3 * a[2] * b[1] + 3 * a[1] * b[2] + a[0] * b[3],
        ]
    )


def sine(angle: Array, phase: float = 0.0) -> Array:
    """Value and derivatives of the sine of a signal."""
    value, d1, d2, d3 = angle
    s, c = np.sin(value + phase), np.cos(value + phase)
    return np.stack([s, c * d1, c * d2 - s * d1**2, c * d3 - 3 * s * d1 * d2 - c * d1**3])


@dataclass(frozen=True)
class Steps:
    """A sum of smooth steps: `sizes[k]` (D,) from `spans[k]` = (start, end) in s."""

    spans: tuple[tuple[float, float], ...]
    sizes: tuple[tuple[float, ...], ...]

    def __call__(self, times: Array) -> Array:
        out = np.zeros((4, len(times), len(self.sizes[0])))
        for span, size in zip(self.spans, self.sizes, strict=True):
            out += smooth_step(times, *span)[..., None] * np.asarray(size)
        return out


@dataclass(frozen=True)
class Oscillation:
    """Sinusoids of one frequency from `start_s` to `end_s`, which swell and fade within `ramp_s` and are modulated."""

    # Coordinate d is amplitude[d] sin(2 pi hz (t - start_s) + phase[d]), times the envelope: 1 in its mean, and 1 +
    # `depth` sin(2 pi modulation_hz (t - start_s)) between the ramps.

    start_s: float
    end_s: float
    ramp_s: float
    hz: float
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]
    depth: float = 0.0
    modulation_hz: float = 0.2

    def envelope(self, times: Array) -> Array:
        """(4, n)."""
        swell = smooth_step(times, self.start_s, self.start_s + self.ramp_s)
        fade = smooth_step(times, self.end_s - self.ramp_s, self.end_s)
        slow = self.depth * sine(self._turning(times, self.modulation_hz))
        slow[0] += 1
        return product(swell - fade, slow)

    def __call__(self, times: Array) -> Array:
        envelope, angle = self.envelope(times), self._turning(times, self.hz)
        waves = [
            a * product(envelope, sine(angle, p)) for a, p in zip(self.amplitudes, self.phases, strict=True)
        ]
        return np.stack(waves, axis=-1)

    def _turning(self, times: Array, hz: float) -> Array:
        angle = np.zeros((4, len(times)))
        angle[0], angle[1] = 2 * np.pi * hz * (times - self.start_s), 2 * np.pi * hz
        return angle


@dataclass(frozen=True)
class Circle:
    """A pen on an irregular ellipse in the plane z = 0, from where it stands at angle 0; `angle` is a signal."""

    # The radius varies with the angle, not with time, so that the pen rests while the angle does.

    angle: Signal
    half_axes: tuple[float, float]
    turn_rad: float
    uneven: tuple[tuple[float, float, float], ...]  # share of the radius, waves per turn, phase

    def __call__(self, times: Array) -> Array:
        out = self._placed(self.angle(times)[..., 0])
        out[0] -= self.arm()
        return out

    def arm(self) -> Array:
        """(3,): from the middle to where the pen starts."""
        return self._placed(np.zeros((4, 1)))[0, 0]

    def _placed(self, angle: Array) -> Array:
        radius = np.zeros_like(angle)
        radius[0] = 1
        for share, waves, phase in self.uneven:
            radius = radius + share * sine(waves * angle, phase)
        x = self.half_axes[0] * product(radius, sine(angle, np.pi / 2))
        y = self.half_axes[1] * product(radius, sine(angle))
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        return np.stack([c * x - s * y, s * x + c * y, np.zeros_like(x)], axis=-1)


@dataclass(frozen=True)
class Swing:
    """An angle that swings with another one: amplitude times its sine."""

    angle: Signal
    amplitude_rad: float

    def __call__(self, times: Array) -> Array:
        return self.amplitude_rad * sine(self.angle(times))


# -- The motion of one object as a function of time: pose, velocity, acceleration, jerk, angular velocity


@dataclass(frozen=True)
class Turn:
    """A rotation about a fixed axis (unit vector) by a constant and a sum of signals, rad."""

    axis: tuple[float, float, float]
    angles: tuple[Signal, ...]
    constant_rad: float = 0.0

    def at(self, times: Array) -> tuple[Array, Array]:
        """Rotations (n, 3, 3) and angular velocities (n, 3)."""
        angle = sum((s(times)[..., 0] for s in self.angles), np.zeros((4, len(times))))
        angle[0] += self.constant_rad
        x, y, z = self.axis
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        sin, cos = np.sin(angle[0])[:, None, None], np.cos(angle[0])[:, None, None]
        return np.eye(3) + sin * cross + (1 - cos) * (cross @ cross), angle[1][:, None] * np.asarray(
            self.axis
        )


@dataclass(frozen=True)
class ObjectMotion:
    """Motion in the table's frame: x to the right, y away from the camera, z up, m."""

    # The position is `start` and the sum of `moves`; the rotation is the product of the `turns`, the last one first.

    start: tuple[float, float, float]
    moves: tuple[Signal, ...]
    turns: tuple[Turn, ...]

    def places(self, times: Array) -> Array:
        """(4, n, 3): position of the origin, velocity, acceleration, jerk."""
        out = sum((s(times) for s in self.moves), np.zeros((4, len(times), 3)))
        out[0] += np.asarray(self.start)
        return out

    def rotations(self, times: Array) -> tuple[Array, Array]:
        """Rotations (n, 3, 3), and angular velocities (n, 3) in the table's axes."""
        R, w = np.tile(np.eye(3), (len(times), 1, 1)), np.zeros((len(times), 3))
        for turn in self.turns:
            own, rate = turn.at(times)
            w = w + np.einsum("nij,nj->ni", R, rate)
            R = R @ own
        return R, w


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
            reaction_s=rng.uniform(0.25, 0.6), pause_s=rng.uniform(0.6, 1.2), move_s=rng.uniform(1.4, 2.6),
            hold_s=rng.uniform(0.6, 1.4), lift_m=rng.uniform(*lift_m),
            parts=int(rng.integers(1, 5)) if parts is None else parts, overlap=rng.uniform(1.15, 2.0),
            bow_m=rng.uniform(0.0, 0.025), axis=(float(np.cos(about)), float(np.sin(about)), 0.0),
            lean_rad=rng.uniform(0.0, 0.15), yaw_rad=rng.uniform(-0.7, 0.7),
        )  # fmt: skip

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
