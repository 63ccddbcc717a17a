# SPDX-License-Identifier: MIT
"""One image through the core: cut to its mask, and put back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.superpixels.arguments import cut, part_with

__all__ = ["core_labels"]

BYTES_PER_PIXEL, BYTES_PER_SEGMENT = 10, 220


def core_labels(
    pixels: NDArray[Any],
    inside: NDArray[np.uint8] | None,
    seen: NDArray[np.float32] | None,
    options: Any,
    workers: int,
    number: int,
) -> NDArray[np.int32]:
    """Labels of an image, a mask and a depth image that have been checked, as `slic` returns them."""
    shape = pixels.shape[:2]
    part = part_with(inside, shape)
    pixels = cut(pixels, part)
    inside, seen = (None if a is None else cut(a, part) for a in (inside, seen))
    try:
        made: NDArray[np.int32] = _core.slic(pixels, options, inside, seen, workers, number)[0]
        if made.shape == shape:
            return made
        labels = np.zeros(shape, np.int32)
        labels[part] = made
        return labels
    except MemoryError:
        segments = min(options.n_segments, pixels.size)
        need = BYTES_PER_PIXEL * pixels.shape[0] * pixels.shape[1] + BYTES_PER_SEGMENT * segments
        raise MemoryError(
            f"image: {shape[0]} x {shape[1]} pixels in {segments} segments need about {need / 2**20:.0f} MiB of "
            "memory, which is not available; split the image"
        ) from None
