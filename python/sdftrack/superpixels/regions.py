# SPDX-License-Identifier: MIT
"""Properties of a label image: boundaries, mean colours, adjacency, sizes and locations of its regions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.array_equality import Compared
from sdftrack.superpixels.arguments import checked_image

RED = (255, 0, 0)
Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Regions(Compared):
    """Arrays with one entry per region, in the order of `labels`.

    Attributes
    ----------
    labels : (R,) int64 array
    areas : (R,) int64 array, pixels
    centroids : (R, 2) float64 array, (x, y) in pixels
    boxes : (R, 4) int64 array, x, y, width, height in pixels
    colors : (R, 3) float64 array, mean RGB in the image's own range (grey: (R, 1)); None without an image
    """

    labels: NDArray[np.int64]
    areas: NDArray[np.int64]
    centroids: Array
    boxes: NDArray[np.int64]
    colors: Array | None


def regions(labels: ArrayLike, image: ArrayLike | None = None) -> Regions:
    """Areas, centroids, boxes and mean colours of the regions of a label image.

    Parameters
    ----------
    labels : (H, W) array of integers >= 0; 0 counts as a region like any other
    image : (H, W, 3) or (H, W) array, optional

    >>> import sdftrack as st
    >>> st.superpixels.regions([[1, 1, 2]]).areas
    array([2, 1])
    """
    L = _labels(labels)
    present, index = np.unique(L, return_inverse=True)
    index = index.reshape(-1)
    n = len(present)
    y, x = np.divmod(np.arange(L.size), L.shape[1])
    areas = np.bincount(index, minlength=n)
    centroids = np.stack([np.bincount(index, v, n) / areas for v in (x, y)], axis=-1)
    low, high = np.full((n, 2), L.size), np.zeros((n, 2), np.int64)
    for axis, v in enumerate((x, y)):
        np.minimum.at(low[:, axis], index, v)
        np.maximum.at(high[:, axis], index, v)
    colors = None
    if image is not None:
        flat = _image(image, L).reshape(L.size, -1)
        colors = np.stack([np.bincount(index, c, n) / areas for c in flat.T], axis=-1)
    return Regions(present.astype(np.int64), areas, centroids, np.hstack([low, high - low + 1]), colors)


def mean_colors(image: ArrayLike, labels: ArrayLike) -> NDArray[Any]:
    """The image with each region filled with its mean colour.

    Parameters
    ----------
    image : (H, W, 3) or (H, W) array of uint8, or of float in 0..1
    labels : (H, W) array of whole numbers

    Returns
    -------
    array like `image`
        uint8 rounded to the nearest, or float32.
    """
    L = _labels(labels)
    pixels = _image(image, L)
    index = np.unique(L, return_inverse=True)[1]
    flat = pixels.reshape(L.size, -1)
    areas = np.bincount(index.reshape(-1))
    means = np.stack([np.bincount(index.reshape(-1), c) / areas for c in flat.T], axis=-1)
    if pixels.dtype == np.uint8:
        means = np.floor(means + 0.5)
    out: NDArray[Any] = means.astype(pixels.dtype)[index.reshape(-1)].reshape(pixels.shape)
    return out


def adjacency(labels: ArrayLike) -> NDArray[np.int64]:
    """Pairs of labels that touch (4 neighbours), the smaller one first.

    Parameters
    ----------
    labels : (H, W) array of whole numbers; 0, which is outside of a mask, counts like every other label

    Returns
    -------
    (N, 2) int64 array, sorted, each pair once

    >>> import sdftrack as st
    >>> st.superpixels.adjacency([[1, 1, 2], [3, 3, 2]]).tolist()
    [[1, 2], [1, 3], [2, 3]]
    """
    L = _labels(labels).astype(np.int64)
    sides = [np.stack([a.ravel(), b.ravel()], axis=-1) for a, b in ((L[:, :-1], L[:, 1:]), (L[:-1], L[1:]))]
    pairs = np.sort(np.concatenate(sides), axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    return np.unique(pairs, axis=0) if len(pairs) else pairs


def boundaries(labels: ArrayLike) -> NDArray[np.bool_]:
    """Pixels whose right or lower neighbour has another label.

    Parameters
    ----------
    labels : (H, W) array of whole numbers

    Returns
    -------
    (H, W) bool array

    >>> import sdftrack as st
    >>> st.superpixels.boundaries([[1, 1, 2], [3, 3, 2]]).tolist()
    [[True, True, False], [False, True, False]]
    """
    L = _labels(labels)
    edges = np.zeros(L.shape, bool)
    edges[:, :-1] |= L[:, :-1] != L[:, 1:]
    edges[:-1] |= L[:-1] != L[1:]
    return edges


def mark_boundaries(
    image: ArrayLike, labels: ArrayLike, color: tuple[int, int, int] = RED
) -> NDArray[np.uint8]:
    """Draw the boundaries of the regions on the image.

    Parameters
    ----------
    image : (H, W, 3) or (H, W) array of uint8, or of float in 0..1
    labels : (H, W) array of whole numbers
    color : (red, green, blue), 0..255

    Returns
    -------
    (H, W, 3) uint8 array, RGB; the pixels of :func:`boundaries` are of that colour
    """
    L = _labels(labels)
    pixels = _image(image, L)
    paint = np.asarray(color)
    if paint.shape != (3,) or paint.dtype.kind not in "iu" or paint.min() < 0 or paint.max() > 255:
        raise ValueError(f"color: expected three whole numbers 0..255 (red, green, blue), got {color!r}")
    picture = pixels if pixels.dtype == np.uint8 else np.floor(255 * pixels + 0.5).astype(np.uint8)
    picture = np.repeat(picture[..., None], 3, axis=2) if picture.ndim == 2 else picture.copy()
    picture[boundaries(L)] = paint
    return picture


def _labels(labels: ArrayLike) -> NDArray[Any]:
    given = np.asarray(labels)
    if given.dtype.kind not in "iu":
        raise TypeError(f"labels: expected an array of whole numbers, got {given.dtype}")
    if given.ndim != 2 or given.size == 0:
        raise ValueError(f"labels: expected (H, W), got {given.shape}")
    if given.dtype == np.uint64 and int(given.max()) > np.iinfo(np.int64).max:
        raise ValueError(f"labels: expected numbers below 2^63, got {int(given.max())}")
    return given


def _image(image: ArrayLike, labels: NDArray[Any]) -> NDArray[Any]:
    pixels = checked_image(image)
    if pixels.shape[:2] != labels.shape:
        raise ValueError(f"image, labels: expected one size, got {pixels.shape[:2]} and {labels.shape}")
    return pixels
