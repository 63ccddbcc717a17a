# SPDX-License-Identifier: MIT
"""Recorded images as arrays: encodings, byte order, padded rows, compressed images. ROS'
compressed_depth_image_transport is a header, then a PNG or RVL image (A. D. Wilson, "Fast Lossless Depth Image
Compression", ISS 2017)."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.frames import decode_color, decode_depth_units

MM = 1e-3  # 16-bit depth is in millimetres, REP 118
DEPTH_ENCODINGS = ("16uc1", "mono16", "32fc1")
# Encoding: dtype, channels, and OpenCV's conversion to RGB ("" where a slice does it).
_PIXELS: dict[str, tuple[str, int, str]] = {
    "rgb8": ("u1", 3, ""),
    "bgr8": ("u1", 3, "reversed"),
    "8uc3": ("u1", 3, "reversed"),  # OpenCV's own order
    "rgba8": ("u1", 4, ""),
    "bgra8": ("u1", 4, "reversed"),
    "8uc4": ("u1", 4, "reversed"),
    "mono8": ("u1", 1, "gray"),
    "8uc1": ("u1", 1, "gray"),
    # OpenCV names a Bayer pattern by its second row and column.
    "bayer_rggb8": ("u1", 1, "COLOR_BayerBG2RGB"),
    "bayer_bggr8": ("u1", 1, "COLOR_BayerRG2RGB"),
    "bayer_gbrg8": ("u1", 1, "COLOR_BayerGR2RGB"),
    "bayer_grbg8": ("u1", 1, "COLOR_BayerGB2RGB"),
    "yuv422": ("u1", 2, "COLOR_YUV2RGB_UYVY"),
    "uyvy": ("u1", 2, "COLOR_YUV2RGB_UYVY"),
    "yuv422_yuy2": ("u1", 2, "COLOR_YUV2RGB_YUYV"),
    "yuyv": ("u1", 2, "COLOR_YUV2RGB_YUYV"),
    "16uc1": ("u2", 1, "depth"),
    "mono16": ("u2", 1, "depth"),
    "32fc1": ("f4", 1, "depth"),
}
COLOR_ENCODINGS = tuple(name for name, (_, _, how) in _PIXELS.items() if how != "depth")
HEADER = struct.Struct("<iff")  # kind, and the two numbers of the quantisation
SIZE = struct.Struct("<II")  # columns and rows, before RVL's words
MAX_PIXELS = 1 << 27
Depth = NDArray[np.uint16] | NDArray[np.float32]


def encoding_of(picture: Picture) -> str:
    text = picture.encoding.lower()
    if picture.width:
        return text
    if is_compressed_depth(picture):
        return "32fc1" if text.startswith("32fc1") else "16uc1"
    start = bytes(picture.data[:26])
    if start.startswith(b"\x89PNG") and start[24:26] == b"\x10\x00":  # bit depth 16, one channel
        return "16uc1"
    return text.partition(";")[0].strip()


def depth_of(picture: Picture, name: str) -> tuple[NDArray[Any], float | None]:
    """A depth image and its scale: (H, W) uint16 and metres per unit, or float32 metres and None. ValueError if it is
    not a depth image, or not whole."""
    if is_compressed_depth(picture):
        image = decode_compressed_depth(picture, name)
    elif not picture.width:
        image = decode_depth_units(bytes(picture.data), name)
    else:
        encoding = picture.encoding.lower()
        if encoding not in DEPTH_ENCODINGS:
            raise ValueError(
                f"{name}: expected depth encoded as 16UC1, mono16 or 32FC1, got {picture.encoding!r}; "
                "choose another topic by depth_topic="
            )
        image = _pixels(picture, name, *_PIXELS[encoding][:2])
    return (image, MM) if image.dtype == np.uint16 else (image, None)


def color_of(picture: Picture, name: str) -> NDArray[np.uint8]:
    """(H, W, 3) uint8 RGB; grey images are repeated, alpha is dropped. ValueError as above."""
    if not picture.width:
        return decode_color(bytes(picture.data), name)
    encoding = picture.encoding.lower()
    if encoding not in COLOR_ENCODINGS:
        raise ValueError(
            f"{name}: expected colour encoded as {', '.join(COLOR_ENCODINGS)}, got {picture.encoding!r}; "
            "choose another topic by color_topic="
        )
    kind, channels, how = _PIXELS[encoding]
    image = _pixels(picture, name, kind, channels)
    if how == "":
        return np.ascontiguousarray(image[..., :3])
    if how == "reversed":
        return np.ascontiguousarray(image[..., 2::-1])
    if how == "gray":
        return np.repeat(image[..., None], 3, axis=2)
    import cv2

    return np.asarray(cv2.cvtColor(np.ascontiguousarray(image), getattr(cv2, how)), dtype=np.uint8)


def _pixels(picture: Picture, name: str, kind: str, channels: int) -> NDArray[Any]:
    dtype = np.dtype(kind)
    row = picture.width * channels * dtype.itemsize
    step, size = picture.step or row, len(picture.data)
    if step < row or picture.height < 1 or size < step * (picture.height - 1) + row:
        raise ValueError(
            f"{name}: expected {picture.height} rows of {row} bytes for {picture.width} x {picture.height} pixels "
            f"of {picture.encoding}, got {size} bytes in rows of {step}"
        )
    flat = np.frombuffer(picture.data, np.uint8)
    rows = np.lib.stride_tricks.as_strided(flat, (picture.height, row), (step, 1), writeable=False)
    stored = dtype.newbyteorder(">" if picture.big_endian else "<")
    pixels = np.ascontiguousarray(rows).view(stored).astype(dtype, copy=False)
    return pixels.reshape(picture.height, picture.width, channels) if channels > 1 else pixels


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
    return np.add.reduceat(values, first)
