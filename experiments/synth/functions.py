# SPDX-License-Identifier: MIT
"""Known functions that a regression may learn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cross(x: Array) -> Array:
    """The cross of two ridges and a bump (Vijayakumar et al. 2005): (N, 2) -> (N, 1)."""
    a, b = x.T
    ridges = np.maximum(np.exp(-10 * a**2), np.exp(-50 * b**2))
    return np.maximum(ridges, 1.25 * np.exp(-5 * (a**2 + b**2)))[:, None]


def cross_data(seed: int, count: int) -> tuple[Array, Array]:
    """Places (N, 2), even in [-1, 1]^2, and the cross there, (N, 1), without noise."""
    x = np.random.default_rng(seed).uniform(-1, 1, (count, 2))
    return x, cross(x)


def surface(latent: Array) -> tuple[Array, Array]:
    """Places (N, 10) on a curved surface and five functions (N, 5) of its two coordinates (N, 2).

    The surface is (a, b, 0.3 sin(2a + b), 0.3 a b) in four dimensions, turned into ten by a fixed orthonormal map.
    """
    a, b = latent.T
    bent = np.stack([a, b, 0.3 * np.sin(2 * a + b), 0.3 * a * b], axis=1)
    into_ten = np.linalg.qr(np.random.default_rng(1234).normal(size=(10, 4)))[0]
    functions = (
        np.sin(3 * a), np.cos(2 * b) * a, np.exp(-3 * (a**2 + b**2)), a * b, np.tanh(3 * (a - b)),
    )  # fmt: skip
    return bent @ into_ten.T, np.stack(functions, axis=1)


def surface_data(seed: int, count: int) -> tuple[Array, Array]:
    """Places (N, 10) and the functions there (N, 5), without noise."""
    return surface(np.random.default_rng(seed).uniform(-1, 1, (count, 2)))
