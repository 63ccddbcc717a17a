# SPDX-License-Identifier: MIT
"""Paths of two solids that touch and never penetrate, and the curves that they are made of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.synth.contact import Solid, first_contact
from sdftrack import geometry

Array = NDArray[np.float64]
# Changing these numbers breaks comparisons with every figure that was printed with them.
MAX_STEP_M, MAX_RAD = 0.005, np.deg2rad(1.5)
CONTACT_M = 0.0005  # wanted gap of a contact; it counts as one up to 1 mm
GAP_RATE_M = 0.002  # per frame: how fast the separation follows a hollow of the shape
DISTANCE_M = 0.8


def apart(solid: Solid, R: Array, middle: Array, direction: Array, gaps: Array) -> Array:
    """(n, 2, 4, 4): two copies of orientation R (n, 2, 3, 3) about `middle`, `gaps` apart along `direction`.

    The separation is at least that of the outermost contact in each frame, and follows it smoothly.
    """
    far = 2 * solid.radius + 0.01
    least = np.array(
        [
            first_contact(solid, [solid.at(Rs[0], m)], Rs[1], m, -d, far, CONTACT_M)
            for Rs, m, d in zip(R, middle, direction, strict=True)
        ]
    )
    for order in (range(1, len(least)), range(len(least) - 2, -1, -1)):
        for i in order:
            neighbour = least[i - 1] if order.step > 0 else least[i + 1]
            least[i] = max(least[i], neighbour - GAP_RATE_M)
    half = 0.5 * (least + gaps - CONTACT_M)[:, None] * direction
    return np.array(
        [[solid.at(Rs[0], m - h), solid.at(Rs[1], m + h)] for Rs, m, h in zip(R, middle, half, strict=True)]
    )


def steps(solid: Solid, poses: Array) -> float:
    """Largest step of a path as a multiple of what is allowed."""
    metres = np.linalg.norm(np.diff(solid.place(poses), axis=0), axis=-1).max(initial=0)
    relative = np.einsum("...ji,...jk->...ik", poses[:-1, :, :3, :3], poses[1:, :, :3, :3])
    cosine = np.clip(0.5 * (np.trace(relative, axis1=-2, axis2=-1) - 1), -1, 1)
    return max(float(metres) / MAX_STEP_M, float(np.arccos(cosine).max(initial=0)) / MAX_RAD)


def wander(n: int, phase: Array) -> Array:
    """A slow path (n, 3) about the middle of the view, at most 0.7 mm a frame."""
    i = np.arange(n)
    rates = np.array([0.012, 0.015, 0.01])
    return np.array([0.03, 0.02, 0.03]) * np.sin(i[:, None] * rates + phase[:3]) + [0, 0, DISTANCE_M]


def spins(first: Array, step_rad: Array, phase: Array) -> Array:
    """(n, M, 3, 3): orientations that turn by step_rad[i] after frame i, each about its own wandering axis."""
    out = [first]
    for i, step in enumerate(step_rad[:-1]):
        turned = []
        for k, R in enumerate(out[-1]):
            axis = np.sin(phase[:3] + 1.7 * k + np.array([0.013, 0.021, 0.03]) * i) + np.array([1e-3, 0, 0])
            turned.append(geometry.pose(step * axis / np.linalg.norm(axis))[:3, :3] @ R)
        out.append(np.array(turned))
    return np.array(out)


def rotations(rng: np.random.Generator, count: int) -> Array:
    q = rng.normal(size=(count, 4))
    angle = 2 * np.arctan2(np.linalg.norm(q[:, 1:], axis=1), q[:, 0])
    return np.array([geometry.pose(a * v)[:3, :3] for a, v in zip(angle, unit(q[:, 1:]), strict=True)])


def unit(v: Array) -> Array:
    out: Array = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return out


def smooth(x: Array) -> Array:
    s = np.clip(x, 0, 1)
    out: Array = s * s * (3 - 2 * s)
    return out


def ramped(s: Array, ramp: float = 0.2) -> Array:
    """0 to 1 at even speed, with that share of the time to get up to it and as much to slow down."""
    top = 1 / (1 - ramp)
    out: Array = np.where(
        s < ramp,
        0.5 * top * s * s / ramp,
        np.where(s > 1 - ramp, 1 - 0.5 * top * (1 - s) ** 2 / ramp, top * (s - 0.5 * ramp)),
    )
    return out
