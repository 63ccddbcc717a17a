# SPDX-License-Identifier: MIT
"""The motion of one object as a function of time: pose, velocity, acceleration, jerk, angular velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.synth.exercise_signals import Signal

__all__ = ["ObjectMotion", "Turn"]

Array = NDArray[np.float64]


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
