# SPDX-License-Identifier: MIT
"""What a contour tracker is given, checked: images, masks, boxes, options."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack.checks import number

__all__ = ["checked_box", "checked_image", "checked_mask_of", "checked_options"]


def checked_options(options: dict[str, Any]) -> dict[str, Any]:
    """Options of the types that the core's are of."""
    known = _core.contour_options()
    checked: dict[str, Any] = {}
    for name, value in options.items():
        if name not in known:
            raise ValueError(f"options: expected some of {', '.join(sorted(known))}, got {name!r}")
        if isinstance(known[name], str):
            checked[name] = str(value)
        elif isinstance(known[name], int):
            if number(value, name) != int(number(value, name)):
                raise ValueError(f"{name}: expected a whole number, got {value!r}")
            checked[name] = int(value)
        else:
            checked[name] = number(value, name)
    return checked


def checked_image(image: ArrayLike) -> NDArray[np.uint8]:
    """(H, W, 3), contiguous."""
    given = np.asarray(image)
    if given.ndim == 2 or (given.ndim == 3 and given.shape[2] == 1):
        raise ValueError(
            f"image: expected colours, (H, W, 3), got a grey image {given.shape}; histograms of colour are what this "
            "tracker lives on, grey repeated three times works where brightness alone tells the object apart"
        )
    if given.ndim != 3 or given.shape[2] != 3:
        raise ValueError(
            f"image: expected (H, W, 3), got {given.shape}; drop an alpha channel with image[..., :3]"
        )
    if given.dtype != np.uint8:
        raise TypeError(
            f"image: expected uint8, got {given.dtype}; scale 0..1 by (255 * image).astype(np.uint8)"
        )
    if min(given.shape[:2]) < 8:
        raise ValueError(f"image: expected at least 8 x 8 pixels, got {given.shape[1]} x {given.shape[0]}")
    return np.ascontiguousarray(given)


def checked_mask_of(mask: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(H, W) bool of an object in an image of that shape, contiguous."""
    given = np.asarray(mask)
    if given.dtype != np.bool_:
        raise TypeError(f"mask: expected bool, got {given.dtype}; use mask > 0")
    if given.shape != shape:
        raise ValueError(f"mask: expected the image's size {shape}, got {given.shape}")
    if given.all():
        raise ValueError(
            "mask: expected background around the object, got a full mask; mark the object alone"
        )
    return np.ascontiguousarray(given)


def checked_box(box: Any, width: int, height: int) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1) of the part inside the image."""
    try:
        x, y, w, h = (float(v) for v in box)
    except (TypeError, ValueError):
        raise TypeError(f"box: expected four numbers (x, y, w, h), got {box!r}") from None
    if not np.isfinite([x, y, w, h]).all() or w <= 0 or h <= 0:
        raise ValueError(f"box: expected (x, y, w, h) with w and h > 0, got {box!r}")
    x0, y0, x1, y1 = max(0, round(x)), max(0, round(y)), min(width, round(x + w)), min(height, round(y + h))
    if x0 >= x1 or y0 >= y1:
        raise ValueError(f"box: expected a box in the {width} x {height} image, got {box!r}")
    return x0, y0, x1, y1
