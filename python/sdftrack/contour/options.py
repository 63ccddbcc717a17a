# SPDX-License-Identifier: MIT
"""Options of the contour tracker, which the core describes (cpp/contour/option_schema.h), and checks of its input."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.option_files import options_from_file, read_tables
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack._internal.validation import mask_of


def contour_options(given: dict[str, Any]) -> _core.ContourOptions:
    """Options by name; TypeError or ValueError names a wrong one."""
    refuse_unknown(given, [*_core.ContourOptions().to_dict(), "memory", "burn_in"])
    return _core.ContourOptions(**given)


def options_of_file(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read and check the table ``[contour]`` of a TOML file; {} if it is missing."""
    options = options_from_file(_core.ContourOptions, path, "contour").to_dict()
    return {name: options[name] for name in read_tables(path)["contour"]}


# -- Checks of what the contour tracker is given


def checked_image(image: ArrayLike) -> NDArray[np.uint8]:
    """(H, W, 3) uint8, contiguous."""
    given = np.asarray(image)
    if given.dtype.kind not in "biuf":
        raise TypeError(f"image: expected (H, W, 3) uint8, got {type(image).__name__}")
    if given.ndim == 2 or (given.ndim == 3 and given.shape[2] == 1):
        raise ValueError(
            f"image: expected colours, (H, W, 3), got a grey image {given.shape}; this tracker is based on colour "
            "histograms; repeat grey three times if brightness alone distinguishes the object"
        )
    if given.ndim != 3 or given.shape[2] != 3:
        raise ValueError(
            f"image: expected (H, W, 3), got {given.shape}; drop an alpha channel with image[..., :3]"
        )
    if given.dtype != np.uint8:
        way = {
            "u": "image >> 8 where it fills 16 bits, then image",
            "f": "(255 * image) where it is 0..1, then image",
        }
        raise TypeError(
            f"image: expected uint8, got {given.dtype}; use {way.get(given.dtype.kind, 'image')}.astype(np.uint8)"
        )
    if min(given.shape[:2]) < 8:
        raise ValueError(f"image: expected at least 8 x 8 pixels, got {given.shape[1]} x {given.shape[0]}")
    return np.ascontiguousarray(given)


def checked_part(mask: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(H, W) bool, contiguous, of the shape of the image, with something outside."""
    inside = mask_of(mask, shape)
    if inside.all():
        raise ValueError("mask: expected background around the object, got a full mask; mark only the object")
    return inside


def checked_box(box: Any, width: int, height: int) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1), clipped to the image."""
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
