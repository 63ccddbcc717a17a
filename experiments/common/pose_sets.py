# SPDX-License-Identifier: MIT
"""Perturbed poses, and the motions that map a shape onto itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _rotation(axis: Array, angle_rad: float) -> Array:
    k = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    K = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.eye(3) + np.sin(angle_rad) * K + (1 - np.cos(angle_rad)) * (K @ K)


def off_pose(T: Array, metres: float, radians: float, rng: np.random.Generator) -> Array:
    """Perturb a pose by exactly `metres` and `radians` in random directions, about the object's origin."""
    d, w = rng.normal(size=3), rng.normal(size=3)
    out = np.array(T, np.float64)
    out[:3, 3] += metres * d / np.linalg.norm(d)
    out[:3, :3] = _rotation(w, radians) @ out[:3, :3]
    return out


def half_turns(centre: Array, quarter_axis: int | None = None) -> list[Array]:
    """Object-frame motions that map a box onto itself: half turns about its axes, with quarter turns about
    one."""
    rotations = [np.eye(3)] + [_rotation(np.eye(3)[k], np.pi) for k in range(3)]
    if quarter_axis is not None:
        quarter = _rotation(np.eye(3)[quarter_axis], np.pi / 2)
        rotations += [quarter @ R for R in rotations]
    out = []
    for R in rotations:
        S = np.eye(4)
        S[:3, :3] = R
        S[:3, 3] = centre - R @ centre
        out.append(S)
    return out
