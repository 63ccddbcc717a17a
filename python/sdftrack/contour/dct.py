# SPDX-License-Identifier: MIT
"""Silhouettes as masks, and as truncated cosine series (thesis Eq. 6.1 to 6.4; docs/math/harmonics.md).

A silhouette is +1 inside and -1 outside. Its orthonormal DCT-II is truncated to the lowest `n` harmonics; "harmonic k"
is the set of all coefficients of order k, where the order of C(u, v) is max(u, v) + 1 (an L-shaped shell, n harmonics
are the n x n block) or u + v + 1 (a diagonal, n harmonics are a triangle).
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import mask_of, one_of, whole

Mask: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[np.float64]
MOST_PX = 4096  # of a grid's side
FILL = 0.35  # square root of the area over the grid's side: a thin body three times as long as wide still fits in


def checked_mask(mask: ArrayLike, name: str = "mask") -> Mask:
    """`mask` as an (H, W) bool array with an inside and an outside; TypeError or ValueError naming the argument."""
    inside = mask_of(mask, None, name)
    if inside.ndim != 2 or min(inside.shape, default=0) < 2:
        raise ValueError(
            f"{name}: expected an image (H, W) of at least 2 x 2 pixels, got shape {inside.shape}"
        )
    if not inside.any():
        raise ValueError(f"{name}: expected some pixels inside, got none; a silhouette needs an object")
    if inside.all():
        raise ValueError(f"{name}: expected some pixels outside, got none; crop the silhouette with a margin")
    return inside


def resampled(mask: Mask, size: int) -> NDArray[np.float32]:
    """(size, size) float32: fraction of each pixel that is inside, by area."""
    if mask.shape == (size, size):
        return mask.astype(np.float32)
    import cv2

    shrinks = mask.shape[0] >= size and mask.shape[1] >= size
    way = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(mask.astype(np.float32), (size, size), interpolation=way), np.float32)


def signed_distances(mask: Mask) -> NDArray[np.float32]:
    """(H, W) float32 distance of each pixel to the edge between inside and outside, pixels, negative inside."""
    import cv2

    mask = np.asarray(mask)
    if mask.dtype != bool or mask.ndim != 2 or not mask.size:
        raise TypeError(f"mask: expected (H, W) bool, got {mask.dtype} {mask.shape}")
    image = mask.astype(np.uint8)
    outside = np.asarray(cv2.distanceTransform(1 - image, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    inside = np.asarray(cv2.distanceTransform(image, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    phi = outside - inside
    # The transforms measure to the first pixel beyond; the edge lies half a pixel before it.
    return np.asarray(phi - 0.5 * np.sign(phi), np.float32)


def align(mask: ArrayLike, size: int = 64, fill: float = FILL) -> tuple[Mask, Array]:
    """Normalise a mask: centroid at the centre, square root of the area `fill` times the side.

    Replaces a tracker's grid for masks that do not come from a tracker. Applies neither rotation nor shear. Alignment
    is meant for unoccluded silhouettes: the centroid of a partly occluded one is not that of the object (use the
    transform of the last unoccluded one with `transformed`).

    Parameters
    ----------
    mask : (H, W) array, bool or uint8
        Not 0: inside.
    size : int
        Side of the output grid, pixels.
    fill : float
        0.05 to 0.9. Parts outside the grid are cropped.

    Returns
    -------
    aligned : (size, size) bool
    T_grid_image : (3, 3) float64
        Maps pixel (x, y, 1) of the image to the grid; ``transformed(mask, T_grid_image, size)`` applies it to another
        mask of the image, ``np.linalg.inv`` is the inverse.

    Raises
    ------
    TypeError, ValueError
        As in `checked_mask`; `size` or `fill` out of range.

    Examples
    --------
    >>> aligned, T_grid_image = st.contour.align(mask)
    """
    inside = checked_mask(mask)
    whole(size, "size", 8, MOST_PX)
    if not 0.05 <= fill <= 0.9:
        raise ValueError(f"fill: expected 0.05 to 0.9, got {fill!r}")
    y, x = np.nonzero(inside)
    scale = fill * size / np.sqrt(len(x))
    middle = (size - 1) / 2
    T = np.array([[scale, 0, middle - scale * x.mean()], [0, scale, middle - scale * y.mean()], [0, 0, 1]])
    return transformed(inside, T, size), T


def transformed(mask: Mask, T_grid_image: Any, size: int) -> Mask:
    """(size, size) bool: a mask of the image resampled to the grid of `align`, by area when shrinking."""
    import cv2

    T = np.asarray(T_grid_image, np.float64)
    fine = max(1, int(np.ceil(1 / np.sqrt(abs(np.linalg.det(T[:2, :2]))))))  # samples per grid pixel and axis
    up = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]])
    image = cv2.warpAffine(
        mask.astype(np.float32), (up @ T)[:2], (fine * size, fine * size), flags=cv2.INTER_LINEAR
    )
    shares = image.reshape(size, fine, size, fine).mean(axis=(1, 3))
    return np.asarray(shares > 0.5)


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
    return block_of(resampled(checked_mask(mask), size), n, order)


def silhouette(
    coefficients: ArrayLike, shape: int | tuple[int, int], order: Order = "max", *, level_set: bool = False
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
    given = (shape, shape) if isinstance(shape, int | np.integer) else tuple(shape)
    if len(given) != 2 or not all(isinstance(x, int | np.integer) and 1 <= x <= 16384 for x in given):
        raise ValueError(f"shape: expected (height, width) in pixels, each 1 to 16384, got {shape!r}")
    h, w = int(given[0]), int(given[1])
    if not level_set:
        return series(coefficients, (h, w), order) > 0
    if h * w > MAX_LEVEL_SET_PX:
        raise ValueError(
            f"shape: expected at most {MAX_LEVEL_SET_PX} pixels with level_set=True, which works on {FINE} x {FINE} "
            f"samples per pixel, got {h} x {w}; use a smaller shape and upscale its distances"
        )
    inside = series(coefficients, (FINE * h, FINE * w), order) > 0
    if inside.all() or not inside.any():
        far = float(np.hypot(h, w))
        return np.full((h, w), -far if inside.all() else far, np.float32)
    # A pixel centre lies in the middle of its FINE x FINE samples.
    fine = signed_distances(inside).reshape(h, FINE, w, FINE)
    return np.asarray(fine.mean(axis=(1, 3)) / FINE, np.float32)


def block_of(inside: NDArray[Any], n: int, order: Order) -> Array:
    """`harmonics` of a square picture of 0 outside and 1 inside, unchecked."""
    return _core.contour_harmonics(np.ascontiguousarray(inside, np.float32), n, order)


def series(coefficients: ArrayLike, shape: tuple[int, int], order: Order = "max", size: int = GRID) -> Array:
    """The cosine series itself, about +1 inside and -1 outside, sampled at the pixel centres of an (H, W) image."""
    # `size` is that of the grid of the coefficients; the sign, and thus the mask, does not depend on it.
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
