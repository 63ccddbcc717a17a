# SPDX-License-Identifier: MIT
"""The format of ROS' compressed_depth_image_transport: a header, then a PNG or RVL image.

RVL: A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.frames import decode_depth_units

__all__ = ["decode_compressed_depth", "is_compressed_depth"]

HEADER = struct.Struct("<iff")  # kind, and the two numbers of the quantisation
SIZE = struct.Struct("<II")  # columns and rows, before RVL's words
MAX_PIXELS = 1 << 27
Depth = NDArray[np.uint16] | NDArray[np.float32]


def is_compressed_depth(picture: Picture) -> bool:
    return not picture.width and "compresseddepth" in picture.encoding.lower()


def decode_compressed_depth(picture: Picture, name: str) -> Depth:
    """(H, W) uint16 units of a 16UC1 image, or float32 metres of a 32FC1 image; ValueError if it is not whole."""
    data = bytes(picture.data)
    if len(data) <= HEADER.size:
        raise ValueError(
            f"{name}: expected a header of {HEADER.size} bytes and an image, got {len(data)} bytes"
        )
    _, a, b = HEADER.unpack_from(data)
    content = data[HEADER.size :]
    if "rvl" in picture.encoding.lower():
        units = decode_rvl(content, name)
    else:
        units = decode_depth_units(content, name)
    if not picture.encoding.lower().startswith("32fc1"):
        return units
    # Stored is a / depth + b, rounded; 0 means "no measurement".
    with np.errstate(divide="ignore", invalid="ignore"):
        metres = np.float32(a) / (units.astype(np.float32) - np.float32(b))
    return np.where((units > 0) & np.isfinite(metres), metres, np.float32(0))


def decode_rvl(data: bytes, name: str) -> NDArray[np.uint16]:
    """Runs of zeros and of differences between neighbours, all numbers in groups of three bits."""
    if len(data) < SIZE.size:
        raise ValueError(f"{name}: the RVL image is truncated")
    columns, rows = SIZE.unpack_from(data)
    if not 0 < columns * rows <= MAX_PIXELS:
        raise ValueError(f"{name}: expected an RVL image, got a size of {columns} x {rows}")
    numbers = _variable_length(data[SIZE.size :])
    out = np.zeros(columns * rows, np.int64)
    at = pixel = 0
    previous = 0
    while pixel < len(out):
        if at + 1 >= len(numbers):
            raise ValueError(f"{name}: the RVL image is truncated")
        pixel += int(numbers[at])
        count = int(numbers[at + 1])
        folded = numbers[at + 2 : at + 2 + count]
        if len(folded) < count or pixel + count > len(out):
            raise ValueError(f"{name}: the RVL image is {'truncated' if len(folded) < count else 'damaged'}")
        if count:
            out[pixel : pixel + count] = previous + np.cumsum((folded >> 1) ^ -(folded & 1))
            previous = int(out[pixel + count - 1])
        at, pixel = at + 2 + count, pixel + count
    return out.astype(np.uint16).reshape(rows, columns)


def _variable_length(data: bytes) -> NDArray[np.int64]:
    """Numbers of 4-bit groups, lowest first: three bits of value, and the top bit if another group follows."""
    words = np.frombuffer(data[: len(data) // 4 * 4], "<u4")
    groups = ((words[:, None] >> np.arange(28, -1, -4, dtype=np.uint32)) & 15).astype(np.int64).ravel()
    last = np.flatnonzero(groups < 8)  # of each number
    if not len(last):
        return np.zeros(0, np.int64)
    groups = groups[: last[-1] + 1]
    first = np.concatenate([[0], last[:-1] + 1])
    place = np.arange(len(groups)) - np.repeat(first, last - first + 1)
    values = (groups & 7) << np.minimum(3 * place, 60)
    total: NDArray[np.int64] = np.add.reduceat(values, first)
    return total
