# SPDX-License-Identifier: MIT
"""Silhouettes as the low part of a cosine series (thesis Eq. 6.1 to 6.4; docs/math/harmonics.md).

A silhouette is +1 inside and -1 outside. Its orthonormal DCT-II is cut to the lowest `n` harmonics; "harmonic k" is the
set of all coefficients of order k, where the order of C(u, v) is max(u, v) + 1 (an L-shaped shell, n harmonics are the
n x n block) or u + v + 1 (a diagonal, n harmonics are a triangle).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.contour.masks import checked_mask, resampled, signed_distances

__all__ = ["Order", "block_of", "count", "harmonic_numbers", "harmonics", "series", "silhouette"]

Array: TypeAlias = NDArray[np.float64]
Order: TypeAlias = Literal["max", "sum"]
GRID = 64  # side of the grid that the coefficients belong to, unless told otherwise
MOST_LEVEL_SET_PX = 2**22  # half a gigabyte of finer samples
FINE = 4  # samples per pixel and axis where a level set is asked for: distances to an eighth of a pixel


def harmonics(mask: ArrayLike, n: int, order: Order = "max", size: int = GRID) -> Array:
    """The coefficients of the first `n` harmonics of a silhouette.

    Parameters
    ----------
    mask : (H, W) array, bool or uint8
        Not 0: inside. Another shape than (size, size) is resampled to it by area; aspect is not kept, so cut a
        square first (`align`, or the tracker's own grid).
    n : int
        How many, 1 to `size`.
    order : {"max", "sum"}
        What harmonic k is: all C(u, v) with max(u, v) + 1 = k, or all with u + v + 1 = k. n = `size` holds the whole
        picture with "max"; with "sum" it leaves out what has u + v >= `size`, and a mask comes
        back to an IoU of 0.9995, not 1.
    size : int
        Side of the grid, pixels; the coefficients of a constant grow with it.

    Returns
    -------
    (m,) float64 array
        m = n^2 for "max", n (n + 1) / 2 for "sum"; harmonic after harmonic, the lowest first. Within one: from
        (u, v) = (0, k - 1), v the column's frequency, along the shell to (k - 1, 0). `harmonic_numbers` says
        which harmonic each coefficient belongs to. The first k harmonics are always the first part.

    Raises
    ------
    TypeError
        `mask` is of another dtype.
    ValueError
        `mask` is not an image, has no inside or no outside; `n`, `order`, `size` out of range.

    Examples
    --------
    >>> coefficients = st.contour.harmonics(mask, 10)          # 100 numbers
    >>> smooth = st.contour.silhouette(coefficients, mask.shape)
    """
    _check(n, order, size)
    return block_of(resampled(checked_mask(mask), size), n, order, size)


def silhouette(
    coefficients: ArrayLike,
    shape: int | tuple[int, int],
    order: Order = "max",
    *,
    level_set: bool = False,
) -> NDArray[Any]:
    """The mask, or the level set, of a cosine series.

    Parameters
    ----------
    coefficients : (m,) array
        As from `harmonics` with the same `order`.
    shape : int or (H, W)
        Of the picture, pixels; any: the series is continuous.
    order : {"max", "sum"}
    level_set : bool
        Give signed distances to the contour instead of the mask.

    Returns
    -------
    (H, W) bool array: True where the series is positive, that is inside. With ``level_set=True`` (H, W) float32:
    distance to the contour in pixels, negative inside, to an eighth of a pixel where pixels are square; everywhere
    plus or minus the picture's diagonal where there is no contour.

    Raises
    ------
    TypeError, ValueError
        `coefficients` are not finite numbers of a length that this order can have; `shape` is not a size.

    Examples
    --------
    >>> phi = st.contour.silhouette(coefficients, (240, 240), level_set=True)
    """
    h, w = _picture_shape(shape)
    if not level_set:
        return series(coefficients, (h, w), order) > 0
    if h * w > MOST_LEVEL_SET_PX:
        raise ValueError(
            f"shape: expected at most {MOST_LEVEL_SET_PX} pixels with level_set=True, which works on {FINE} x {FINE} "
            f"places in each, got {h} x {w}; take a smaller shape and enlarge its distances"
        )
    inside = series(coefficients, (FINE * h, FINE * w), order) > 0
    return _distances(inside, h, w)


def block_of(inside: NDArray[Any], n: int, order: Order, size: int) -> Array:
    """`harmonics` of a (size, size) picture of 0 outside and 1 inside, unchecked: for the memory's inner loop."""
    rows = _basis(n, size, size)
    block = (
        rows @ (2.0 * inside - 1.0) @ rows.T
    )  # (n, n): only the low block is needed, so two thin products do
    u, v, _ = _layout(n, order)
    return np.asarray(block[u, v], np.float64)


def series(coefficients: ArrayLike, shape: tuple[int, int], order: Order = "max", size: int = GRID) -> Array:
    """The cosine series itself, about +1 inside and -1 outside, sampled at the pixel centres of (H, W).

    `size` is that of the grid the coefficients were taken on; the sign, and so the mask, does not depend on it.
    """
    c = np.asarray(coefficients)
    n = _harmonics_in(c, order)
    u, v, _ = _layout(n, order)
    block = np.zeros((n, n))
    block[u, v] = c
    f = _basis(n, shape[0], size).T @ block @ _basis(n, shape[1], size)
    return np.asarray(f, np.float64)


def count(n: int, order: Order = "max") -> int:
    """How many coefficients the first `n` harmonics have."""
    return n * n if order == "max" else n * (n + 1) // 2


def harmonic_numbers(n: int, order: Order = "max") -> NDArray[np.int64]:
    """(m,) harmonic, 1 to n, of each coefficient that `harmonics` gives."""
    _check(n, order, max(n, 1))
    return _layout(n, order)[2].copy()


@lru_cache(maxsize=32)
def _layout(n: int, order: Order) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Frequencies u (rows), v (columns) and harmonic of each coefficient, in the documented order."""
    found: list[tuple[int, int, int]] = []
    for k in range(n):
        if order == "max":
            found += [(u, k, k + 1) for u in range(k)] + [(k, v, k + 1) for v in range(k, -1, -1)]
        else:
            found += [(u, k - u, k + 1) for u in range(k + 1)]
    u, v, number = np.array(found, np.int64).T
    return u, v, number


@lru_cache(maxsize=64)
def _basis(n: int, samples: int, size: int) -> Array:
    """(n, samples): the first n cosines of a grid of `size`, sampled at `samples` even places (Eq. 6.1, 6.2)."""
    x = (np.arange(samples) + 0.5) / samples
    rows = np.sqrt(2.0 / size) * np.cos(np.pi * np.arange(n)[:, None] * x)
    rows[0] = np.sqrt(1.0 / size)
    rows.setflags(write=False)  # shared by all callers
    return np.asarray(rows, np.float64)


def _distances(inside: NDArray[np.bool_], h: int, w: int) -> NDArray[np.float32]:
    """Signed distances at the (h, w) pixel centres, in pixels, from a mask that is FINE times finer."""
    if inside.all() or not inside.any():
        far = float(np.hypot(h, w))
        return np.full((h, w), -far if inside.all() else far, np.float32)
    # A pixel centre lies in the middle of its FINE x FINE samples.
    fine = signed_distances(inside).reshape(h, FINE, w, FINE)
    return np.asarray(fine.mean(axis=(1, 3)) / FINE, np.float32)


def _check(n: int, order: str, size: int) -> None:
    if isinstance(size, bool) or not isinstance(size, int | np.integer) or not 2 <= size <= 4096:
        raise ValueError(f"size: expected a whole number of pixels, 2 to 4096, got {size!r}")
    if order not in ("max", "sum"):
        raise ValueError(f'order: expected "max" or "sum", got {order!r}')
    if isinstance(n, bool) or not isinstance(n, int | np.integer):
        raise TypeError(f"n: expected a whole number of harmonics, got {n!r}")
    if not 1 <= n <= size:
        raise ValueError(
            f"n: expected 1 to {size} harmonics (a grid of {size} pixels has no more), got {n}; "
            "take fewer or a larger size"
        )


def _harmonics_in(c: NDArray[Any], order: str) -> int:
    """How many harmonics a vector of coefficients has; an error where its length fits no number."""
    if c.dtype.kind not in "iuf":
        raise TypeError(f"coefficients: expected numbers, as from harmonics(), got dtype {c.dtype}")
    if order not in ("max", "sum"):
        raise ValueError(f'order: expected "max" or "sum", got {order!r}')
    m = c.size
    n = round(np.sqrt(m)) if order == "max" else int((np.sqrt(8 * m + 1) - 1) / 2 + 0.5)
    if c.ndim != 1 or m == 0 or count(n, order) != m:  # type: ignore[arg-type]
        lengths = "n^2" if order == "max" else "n (n + 1) / 2"
        raise ValueError(
            f'coefficients: expected one dimension of {lengths} numbers (order "{order}"), got shape {c.shape}'
        )
    if not np.isfinite(c).all():
        raise ValueError("coefficients: expected finite numbers, got NaN or infinity")
    return n


def _picture_shape(shape: int | tuple[int, int]) -> tuple[int, int]:
    given = (shape, shape) if isinstance(shape, int | np.integer) else tuple(shape)
    if len(given) != 2 or not all(isinstance(x, int | np.integer) and 1 <= x <= 16384 for x in given):
        raise ValueError(f"shape: expected (height, width) in pixels, each 1 to 16384, got {shape!r}")
    return int(given[0]), int(given[1])
