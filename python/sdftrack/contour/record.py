# SPDX-License-Identifier: MIT
"""Base of the results of this package: read-only arrays, equality, pickling, images."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.array_equality import Compared

__all__ = ["ArrayRecord", "mask_png"]

PICTURE_PX = 240  # height of a picture in a notebook, at most


class ArrayRecord(Compared):
    """Base of a frozen dataclass (``eq=False``) some of whose fields are arrays.

    Arrays are stored as read-only copies.
    """

    def __post_init__(self) -> None:
        for name, value in self._values().items():
            if isinstance(value, np.ndarray):
                own = value.copy()
                own.setflags(write=False)
                object.__setattr__(self, name, own)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(
            self._values().values()
        )  # through __post_init__, so that a copy cannot be written


def mask_png(mask: NDArray[np.bool_], more: NDArray[np.bool_] | None = None) -> bytes:
    """PNG of a silhouette, white on black; pixels only in `more` are orange."""
    import cv2

    picture = np.zeros((*mask.shape, 3), np.uint8)
    if more is not None:
        picture[more] = (40, 140, 250)  # BGR
    picture[mask] = 255
    height = min(PICTURE_PX, mask.shape[0])
    width = max(1, round(mask.shape[1] * height / mask.shape[0]))
    small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".png", small)[1])
