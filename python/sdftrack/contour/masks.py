# SPDX-License-Identifier: MIT
"""Preparation of masks for the shape memory: validation, resampling, alignment."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import mask_of, whole

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
