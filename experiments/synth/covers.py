# SPDX-License-Identifier: MIT
"""Occluders of a silhouette: removal of a given share of a mask's pixels."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Mask: TypeAlias = NDArray[np.bool_]
Region: TypeAlias = Callable[[float], Mask]  # grows with its argument, from nothing at 0 to everything at 1


def hide(mask: Mask, share: float, by: str = "rectangle", seed: int | np.random.Generator = 0) -> Mask:
    """Remove the part of a mask that is covered by an occluder.

    Parameters
    ----------
    mask : (H, W) bool
    share : float
        Share of its pixels that are removed, 0 to 1; accurate to one row of pixels of the occluder.
    by : {"rectangle", "bar", "fence"}
        A rectangle around a random pixel of the mask, sides up to 4 : 1; a bar through a random pixel in a random
        direction; vertical or horizontal slats an eighth of the image apart.
    seed : int or numpy Generator

    Returns
    -------
    (H, W) bool

    Examples
    --------
    >>> half = hide(masks[0], 0.5, "bar", seed=1)
    """
    if by not in HIDDEN_BY:
        raise ValueError(f"by: expected one of {', '.join(HIDDEN_BY)}, got {by!r}")
    m = np.asarray(mask)
    if m.dtype != bool or m.ndim != 2 or not m.any():
        raise ValueError(f"mask: expected (H, W) bool with something inside, got {m.dtype} {m.shape}")
    if not 0 <= share <= 1:
        raise ValueError(f"share: expected 0 to 1, got {share!r}")
    if share == 0:
        return m.copy()
    rng = seed if isinstance(seed, np.random.Generator) else np.random.default_rng(seed)
    region = HIDDEN_BY[by](m, rng)
    low, high, wanted = 0.0, 1.0, share * np.count_nonzero(m)
    for _ in range(20):
        middle = (low + high) / 2
        if np.count_nonzero(m & region(middle)) >= wanted:
            high = middle
        else:
            low = middle
    return np.asarray(m & ~region(high))


def _place(mask: Mask, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """x and y of all pixels, from a random one of the mask."""
    y, x = np.nonzero(mask)
    i = rng.integers(len(y))
    rows, columns = np.indices(mask.shape)
    return columns - x[i], rows - y[i]


def _rectangle(mask: Mask, rng: np.random.Generator) -> Region:
    x, y = _place(mask, rng)
    stretch = np.exp(rng.uniform(-np.log(2), np.log(2)))
    reach = 2 * max(mask.shape)
    return lambda t: (np.abs(x) <= reach * t * stretch) & (np.abs(y) <= reach * t / stretch)


def _bar(mask: Mask, rng: np.random.Generator) -> Region:
    x, y = _place(mask, rng)
    angle = rng.uniform(0, np.pi)
    off = np.abs(x * np.cos(angle) + y * np.sin(angle))
    return lambda t: off <= 2 * max(mask.shape) * t


def _fence(mask: Mask, rng: np.random.Generator) -> Region:
    x, y = _place(mask, rng)
    across = x if rng.random() < 0.5 else y
    period = max(mask.shape) / 8
    within = np.mod(across + rng.uniform(0, period), period)
    return lambda t: within < period * t


HIDDEN_BY: dict[str, Callable[[Mask, np.random.Generator], Region]] = {
    "rectangle": _rectangle,
    "bar": _bar,
    "fence": _fence,
}
