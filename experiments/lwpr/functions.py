# SPDX-License-Identifier: MIT
"""Known functions of one to ten inputs, for the regression without chosen settings."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.synth.functions import cross

Array = NDArray[np.float64]
Rng = np.random.Generator


class Case(NamedTuple):
    """Places, the function there (N, m), samples to learn, the sd of their noise, and the largest nMSE wanted."""

    places: Callable[[Rng, int], Array]
    value: Callable[[Array], Array]
    samples: int
    noise: float
    target: float = np.nan


def uniform(low: float, high: float, n: int) -> Callable[[Rng, int], Array]:
    return lambda rng, count: rng.uniform(low, high, (count, n))


def normal(n: int) -> Callable[[Rng, int], Array]:
    return lambda rng, count: rng.normal(0, 1, (count, n))


def friedman_1(x: Array) -> Array:
    """Five of ten inputs count (Friedman 1991)."""
    return (10 * np.sin(np.pi * x[:, 0] * x[:, 1]) + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4])[
        :, None
    ]


def circuit(rng: Rng, count: int) -> Array:
    """The inputs of Friedman's second and third function: resistance, frequency, inductance, capacity."""
    return rng.uniform([0, 40 * np.pi, 0, 1], [100, 560 * np.pi, 1, 11], (count, 4))


def _reactance(x: Array) -> Array:
    return np.asarray(x[:, 1] * x[:, 2] - 1 / (x[:, 1] * x[:, 3]))


def friedman_2(x: Array) -> Array:
    """The size of an impedance."""
    return np.hypot(x[:, 0], _reactance(x))[:, None]


def friedman_3(x: Array) -> Array:
    """Its angle."""
    return np.arctan2(_reactance(x), x[:, 0])[:, None]


def arm_states(rng: Rng, count: int) -> Array:
    """Angles, velocities and accelerations of two joints."""
    far = np.repeat([np.pi / 2, 2, 4], 2)
    return rng.uniform(-far, far, (count, 6))


def arm_torques(x: Array) -> Array:
    """Of two joints of rods of 1 m and 1 kg, in the field of gravity, N m."""
    q1, q2, d1, d2, a1, a2 = x.T
    inertia, g, c, s = 1 / 12, 9.81, np.cos(q2), np.sin(q2)
    m11, m12, m22 = 2 * inertia + 1.5 + c, inertia + 0.25 + 0.5 * c, inertia + 0.25
    fore = 0.5 * g * np.cos(q1 + q2)
    t1 = m11 * a1 + m12 * a2 - 0.5 * s * (2 * d1 * d2 + d2**2) + 1.5 * g * np.cos(q1) + fore
    return np.stack([t1, m12 * a1 + m22 * a2 + 0.5 * s * d1**2 + fore], axis=1)


def peaks(x: Array) -> Array:
    a, b = x.T
    hill = 3 * (1 - a) ** 2 * np.exp(-(a**2) - (b + 1) ** 2)
    return (hill - 10 * (a / 5 - a**3 - b**5) * np.exp(-(a**2) - b**2))[:, None]


def ishigami(x: Array) -> Array:
    return (np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))[:, None]


def bump(x: Array) -> Array:
    return np.exp(-0.2 * (x**2).sum(axis=1))[:, None] + 0.3 * x[:, :1]


def products(x: Array) -> Array:
    return (np.sin(2 * x[:, 0] + x[:, 1]) + x[:, 2] * x[:, 3] + 0.5 * x[:, 4])[:, None]


def ramp(x: Array) -> Array:
    return (x @ np.linspace(0, 1, x.shape[1]))[:, None]


# Changing these numbers breaks comparisons.
REPORTED_ON = {
    "cross, 2 inputs": Case(uniform(-1, 1, 2), cross, 20_000, 0.1, 0.015),
    "Friedman 1, 10 inputs": Case(uniform(0, 1, 10), friedman_1, 4000, 1.0, 0.121),
    "Friedman 2, 4 inputs": Case(circuit, friedman_2, 4000, 125.0, 0.0037),
    "Friedman 3, 4 inputs": Case(circuit, friedman_3, 4000, 0.1, 0.114),
    "two-link arm, 6 inputs": Case(arm_states, arm_torques, 4000, 0.5, 0.088),
}
CHOSEN_ON = {
    "sinc, 1 input": Case(uniform(-3, 3, 1), np.sinc, 1000, 0.1),
    "peaks, 2 inputs": Case(normal(2), peaks, 4000, 0.3),
    "Ishigami, 3 inputs": Case(uniform(-np.pi, np.pi, 3), ishigami, 4000, 0.5),
    "bump, 5 inputs": Case(normal(5), bump, 4000, 0.05),
    "products, 8 inputs": Case(uniform(-1, 1, 8), products, 4000, 0.1),
    "ramp, 10 inputs": Case(normal(10), ramp, 2000, 0.5),
}


JOINTS = 7
LINK_M, LINK_KG = 0.25, 2.0


def long_arm_states(rng: Rng, count: int) -> Array:
    """Angles, velocities and accelerations of seven joints."""
    far = np.repeat([np.pi / 2, 2, 4], JOINTS)
    return rng.uniform(-far, far, (count, 3 * JOINTS))


def long_arm_torques(x: Array) -> Array:
    """Of seven joints whose axes alternate between z and y, rods along x, N m: recursive Newton-Euler."""
    q, dq, ddq = np.split(x, 3, axis=1)
    n = len(x)
    along = np.array([LINK_M, 0, 0])
    inertia = LINK_KG * LINK_M**2 / 12 * np.diag([0.0, 1, 1])
    w, a_turn = np.zeros((n, 3)), np.zeros((n, 3))
    a = np.tile([0, 0, 9.81], (n, 1))  # the ground accelerates upwards: gravity
    turns, forces, moments = [], [], []
    for j in range(JOINTS):
        axis = np.eye(3)[2 if j % 2 == 0 else 1]
        R = _about(axis, q[:, j])  # maps this link's coordinates to the one before
        back = np.swapaxes(R, 1, 2)
        w, a_turn, a = (np.einsum("nij,nj->ni", back, v) for v in (w, a_turn, a))
        a_turn = a_turn + ddq[:, j : j + 1] * axis + np.cross(w, dq[:, j : j + 1] * axis)
        w = w + dq[:, j : j + 1] * axis
        turns.append(R)
        middle = a + np.cross(a_turn, along / 2) + np.cross(w, np.cross(w, along / 2))
        forces.append(LINK_KG * middle)
        moments.append(a_turn @ inertia + np.cross(w, w @ inertia))
        a = a + np.cross(a_turn, along) + np.cross(w, np.cross(w, along))
    force, moment, torques = np.zeros((n, 3)), np.zeros((n, 3)), np.empty((n, JOINTS))
    for j in reversed(range(JOINTS)):
        if j + 1 < JOINTS:
            force, moment = (np.einsum("nij,nj->ni", turns[j + 1], v) for v in (force, moment))
        moment = moments[j] + moment + np.cross(along / 2, forces[j]) + np.cross(along, force)
        force = force + forces[j]
        torques[:, j] = moment[:, 2 if j % 2 == 0 else 1]
    return torques


def _about(axis: Array, angle: Array) -> Array:
    K, a = np.cross(np.eye(3), axis), angle[:, None, None]
    return np.asarray(np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * (K @ K))


BESIDE_RIVALS = {name: case for name, case in REPORTED_ON.items() if "arm" not in name} | {
    "seven-joint arm, 21 inputs": Case(long_arm_states, long_arm_torques, 4000, 0.5)
}
