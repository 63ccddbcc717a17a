# SPDX-License-Identifier: MIT
"""Silhouettes as truncated cosine series (thesis Eq. 6.1 to 6.4; docs/math/harmonics.md).

A silhouette is +1 inside and -1 outside. Its orthonormal DCT-II is truncated to the lowest `n` harmonics; "harmonic k"
is the set of all coefficients of order k, where the order of C(u, v) is max(u, v) + 1 (an L-shaped shell, n harmonics
are the n x n block) or u + v + 1 (a diagonal, n harmonics are a triangle).
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import one_of, whole
from sdftrack.contour.masks import MOST_PX, checked_mask, resampled, signed_distances

Array: TypeAlias = NDArray[np.float64]
Order: TypeAlias = Literal["max", "sum"]
GRID = 64  # side of the grid that the coefficients belong to, unless told otherwise
MAX_LEVEL_SET_PX = 2**22  # half a gigabyte of finer samples
FINE = 4  # samples per pixel and axis where a level set is asked for: distances to an eighth of a pixel


def harmonics(mask: ArrayLike, n: int, order: Order = "max", size: int = GRID) -> Array:
    """Coefficients of the first `n` harmonics of a silhouette.

    Parameters
    ----------
    mask : (H, W) array, bool or uint8
        Nonzero: inside. Other shapes are resampled to (size, size) by area; the aspect ratio is not kept, so crop a
        square first (`align`, or the tracker's own grid).
    n : int
        Number of harmonics, 1 to `size`.
    order : {"max", "sum"}
        Definition of harmonic k: all C(u, v) with max(u, v) + 1 = k, or all with u + v + 1 = k. With "max", n = `size`
        represents the whole image; with "sum", coefficients with u + v >= `size` are omitted, and a mask is recovered
        with an IoU of 0.9995, not 1.
    size : int
        Side of the grid, pixels; the coefficients of a constant grow with it.

    Returns
    -------
    (m,) float64 array
        m = n^2 for "max", n (n + 1) / 2 for "sum"; ordered by harmonic, the lowest first. Within a harmonic: from (u,
        v) = (0, k - 1), v the column frequency, along the shell to (k - 1, 0). `harmonic_numbers` gives the harmonic of
        each coefficient. The first k harmonics always come first.

    Raises
    ------
    TypeError
        `mask` has an unsupported dtype.
    ValueError
        `mask` is not an image, or has no inside or no outside; `n`, `order`, `size` out of range.

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
    """Reconstruct the mask, or the level set, from a cosine series.

    Parameters
    ----------
    coefficients : (m,) array
        As returned by `harmonics` with the same `order`.
    shape : int or (H, W)
        Size of the image, pixels; arbitrary, because the series is continuous.
    order : {"max", "sum"}
    level_set : bool
        Return signed distances to the contour instead of the mask.

    Returns
    -------
    (H, W) bool array: True where the series is positive, i.e. inside. With ``level_set=True`` (H, W) float32: distance
    to the contour in pixels, negative inside, accurate to an eighth of a pixel for square pixels; plus or minus the
    image diagonal everywhere if there is no contour.

    Raises
    ------
    TypeError, ValueError
        `coefficients` are not finite, or their number does not match the order; `shape` is not a size.

    Examples
    --------
    >>> phi = st.contour.silhouette(coefficients, (240, 240), level_set=True)
    """
    h, w = _picture_shape(shape)
    if not level_set:
        return series(coefficients, (h, w), order) > 0
    if h * w > MAX_LEVEL_SET_PX:
        raise ValueError(
            f"shape: expected at most {MAX_LEVEL_SET_PX} pixels with level_set=True, which works on {FINE} x {FINE} "
            f"samples per pixel, got {h} x {w}; use a smaller shape and upscale its distances"
        )
    inside = series(coefficients, (FINE * h, FINE * w), order) > 0
    return _distances(inside, h, w)


def block_of(inside: NDArray[Any], n: int, order: Order, size: int) -> Array:
    """`harmonics` of a (size, size) picture of 0 outside and 1 inside, unchecked."""
    return _core.contour_harmonics(np.ascontiguousarray(inside, np.float32), n, order)


def series(coefficients: ArrayLike, shape: tuple[int, int], order: Order = "max", size: int = GRID) -> Array:
    """The cosine series itself, about +1 inside and -1 outside, sampled at the pixel centres of an (H, W) image.

    `size` is that of the grid of the coefficients; the sign, and thus the mask, does not depend on it.
    """
    c = np.asarray(coefficients)
    n = _harmonics_in(c, order)
    return _core.contour_series(np.ascontiguousarray(c, np.float64), n, order, *shape, size)


def count(n: int, order: Order = "max") -> int:
    """Number of coefficients of the first `n` harmonics."""
    return n * n if order == "max" else n * (n + 1) // 2


def harmonic_numbers(n: int, order: Order = "max") -> NDArray[np.int64]:
    """(m,) harmonic, 1 to n, of each coefficient returned by `harmonics`."""
    _check(n, order, max(n, 1))
    return np.array(_core.contour_harmonic_numbers(n, order), np.int64)


def _distances(inside: NDArray[np.bool_], h: int, w: int) -> NDArray[np.float32]:
    """Signed distances at the (h, w) pixel centres, in pixels, from a mask that is FINE times finer."""
    if inside.all() or not inside.any():
        far = float(np.hypot(h, w))
        return np.full((h, w), -far if inside.all() else far, np.float32)
    # A pixel centre lies in the middle of its FINE x FINE samples.
    fine = signed_distances(inside).reshape(h, FINE, w, FINE)
    return np.asarray(fine.mean(axis=(1, 3)) / FINE, np.float32)


def _check(n: int, order: str, size: int) -> None:
    whole(size, "size", 2, MOST_PX)
    one_of(order, ("max", "sum"), "order")
    whole(n, "n", 1, int(size), f"1 to {size} harmonics (a grid of {size} pixels has no more)")


def _harmonics_in(c: NDArray[Any], order: str) -> int:
    """Number of harmonics in a vector of coefficients; an error if its length is invalid."""
    if c.dtype.kind not in "iuf":
        raise TypeError(f"coefficients: expected numbers, as returned by harmonics(), got dtype {c.dtype}")
    one_of(order, ("max", "sum"), "order")
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
