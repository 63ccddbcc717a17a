# SPDX-License-Identifier: MIT
"""Optical flow around an object, from each image back to the last one."""

from __future__ import annotations

from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
MARGIN = 0.4  # of the longer side of the object's box, around it
MIN_MARGIN_PX = 16
MIN_SIDE_PX = 32  # of an image whose flow can be computed
MAX_SIDE_PX = 160  # a larger part is examined at a lower resolution


# (h, w, 2) float32, (x, y): how far the place of each pixel in the last image is from it, of a part; its corner x0, y0.
BackwardFlow: TypeAlias = tuple[NDArray[np.float32], int, int]


class ImageFlow:
    """Dense inverse search (OpenCV's DIS) on the part of each image around the object."""

    def __init__(self, image: NDArray[np.uint8]) -> None:
        self._last = _gray(image)
        self._dis = _dense_inverse_search()

    def __getstate__(self) -> NDArray[np.uint8]:
        return self._last

    def __setstate__(self, last: NDArray[np.uint8]) -> None:
        self._last, self._dis = last, _dense_inverse_search()

    def next(self, image: NDArray[np.uint8], mask: Mask) -> BackwardFlow | None:
        """Flow from this image to the last one around the last mask; None if that is empty or the part too small."""
        before, self._last = self._last, _gray(image)
        if not mask.any():
            return None
        rows, columns = _around(mask)
        a, b = before[rows, columns], self._last[rows, columns]
        height, width = a.shape
        scale = min(1.0, MAX_SIDE_PX / max(a.shape))
        if min(a.shape) * scale < MIN_SIDE_PX:
            return None
        small = (round(scale * width), round(scale * height))
        back = self._dis.calc(_resized(b, small), _resized(a, small), None)
        if scale < 1:
            back = cv2.resize(back, (width, height))
            # By rows of pairs: a product over a last axis of two is ten times slower.
            pairs = np.tile(np.array([width / small[0], height / small[1]], np.float32), width)
            np.multiply(back.reshape(height, -1), pairs, out=back.reshape(height, -1))
        return np.ascontiguousarray(back, np.float32), columns.start, rows.start


def _dense_inverse_search() -> Any:
    dis: Any = cv2  # OpenCV's stubs lack it
    out = dis.DISOpticalFlow_create(dis.DISOPTICAL_FLOW_PRESET_FAST)
    out.setFinestScale(1)
    return out


def _gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)


def _around(mask: Mask) -> tuple[slice, slice]:
    """Rows and columns of the mask and its surroundings."""
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    margin = max(MIN_MARGIN_PX, round(MARGIN * max(w, h)))
    height, width = mask.shape
    rows = slice(max(0, y - margin), min(height, y + h + margin))
    return rows, slice(max(0, x - margin), min(width, x + w + margin))


def _resized(image: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
