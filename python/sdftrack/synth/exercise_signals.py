# SPDX-License-Identifier: MIT
"""Signals with exact derivatives, of which exercises are composed, and the motion of an object by them.

A signal is a function of times (n,) that returns its value and its first three derivatives, (4, n, D).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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
    return np.stack(
        [s, c * d1, c * d2 - s * d1**2, c * d3 - 3 * s * d1 * d2 - c * d1**3],
    )


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
    """Sinusoids of one frequency from `start_s` to `end_s`, which swell and fade within `ramp_s` and are modulated.

    Coordinate d is amplitude[d] sin(2 pi hz (t - start_s) + phase[d]), times the envelope: 1 in its mean, and
    1 + `depth` sin(2 pi modulation_hz (t - start_s)) between the ramps.
    """

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
    """A pen on an irregular ellipse in the plane z = 0, from where it stands at angle 0; `angle` is a signal.

    The radius varies with the angle, not with time, so that the pen rests while the angle does.
    """

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
    """Motion in the table's frame: x to the right, y away from the camera, z up, m.

    The position is `start` and the sum of `moves`; the rotation is the product of the `turns`, the last one first.
    """

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
