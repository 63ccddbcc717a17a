# SPDX-License-Identifier: MIT
"""Distances on a grid in plain numpy: swept voxel by voxel, sampled point by point. Slow and obvious."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def fast_sweep(known: Array, u: Array, h: float, rounds: int = 2) -> Array:
    """Solve |grad u| = 1 on a grid [z, y, x] from the values where `known`, voxel by voxel (Zhao, 2005)."""
    u = np.where(known, u, 1e30).astype(np.float64)
    sizes = u.shape
    for _ in range(rounds):
        for order in np.ndindex(2, 2, 2):
            ranges = [
                range(n) if flag else range(n - 1, -1, -1) for n, flag in zip(sizes, order, strict=True)
            ]
            for z in ranges[0]:
                for y in ranges[1]:
                    for x in ranges[2]:
                        if not known[z, y, x]:
                            u[z, y, x] = min(u[z, y, x], _godunov(_neighbours(u, (z, y, x)), h))
    return u


def _neighbours(u: Array, at: tuple[int, int, int]) -> list[float]:
    out = []
    for axis in range(3):
        sides = []
        for step in (-1, 1):
            i = list(at)
            i[axis] += step
            if 0 <= i[axis] < u.shape[axis]:
                sides.append(u[tuple(i)])
        out.append(min(sides))
    return sorted(out)


def _godunov(a: list[float], h: float) -> float:
    """Smallest x with sum of max(x - a_i, 0)^2 = h^2, a sorted."""
    for k in (1, 2, 3):
        mean, square = sum(a[:k]) / k, sum((v - sum(a[:k]) / k) ** 2 for v in a[:k])
        x = mean + np.sqrt(max(0.0, (h * h - square) / k))
        if k == 3 or x <= a[k]:
            return float(x)
    raise AssertionError


def sample(values: Array, voxel_size: float, origin: Array, point: Array) -> tuple[float, Array]:
    """phi and gradient of the trilinear interpolant at one point, continued outside the box as |p - q|."""
    x = (np.asarray(point) - origin) / voxel_size
    n = np.array(values.shape[::-1])
    q = np.clip(x, 0, n - 1)
    cell = np.minimum(q.astype(int), n - 2)
    f = q - cell
    phi, gradient = 0.0, np.zeros(3)
    for corner in np.ndindex(2, 2, 2):
        c = np.array(corner)
        weights = np.where(c == 1, f, 1 - f)
        value = float(values[tuple((cell + c)[::-1])])
        phi += value * weights.prod()
        for axis in range(3):
            others = np.delete(weights, axis).prod()
            gradient[axis] += value * others * (1 if c[axis] else -1) / voxel_size
    beyond = x - q
    length = float(np.linalg.norm(beyond))
    if length > 0:
        phi += voxel_size * length
        gradient = np.where(beyond != 0, beyond / length, gradient)
    return phi, gradient
