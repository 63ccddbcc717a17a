# SPDX-License-Identifier: MIT
"""Depth in OpenEXR files, decoded by FFmpeg (PyAV): one channel of any name."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack._internal.text_files import reason_of

EXR_START = b"v/1\x01"
_AFTER_NAME = 16  # bytes of a channel: type, whether linear, sampling


def decode_exr(data: bytes, name: str) -> NDArray[np.float32]:
    """(H, W) float32 of the content of a file; ValueError for several channels or damage, ImportError without PyAV."""
    av: Any = need("av", "video")
    try:
        at, channels = _channels(data)
    except (struct.error, IndexError, KeyError, ValueError):
        raise ValueError(f"{name}: the EXR file is truncated or damaged") from None
    if len(channels) != 1 or len(channels[0]) != 1:
        raise ValueError(
            f"{name}: expected EXR depth in one channel with a name of one letter, got {', '.join(channels) or 'none'}"
        )
    luminance = data[:at] + b"Y" + data[at + 1 :]  # the only single channel that FFmpeg decodes
    try:
        decoder = av.CodecContext.create("exr", "r")
        frames = [*decoder.decode(av.Packet(luminance)), *decoder.decode(None)]
        return np.asarray(frames[0].to_ndarray(), np.float32)
    except (av.FFmpegError, IndexError, ValueError) as error:
        raise ValueError(f"{name}: the EXR file cannot be decoded ({reason_of(error)})") from None


def _channels(data: bytes) -> tuple[int, list[str]]:
    """Where the name of the first channel begins, and the names of all; ValueError for a file without its last rows.

    FFmpeg gives zeros for rows that are missing, which would be pixels without a measurement.
    """
    places, at = {}, 8
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<I", data, at)
        places[name] = at + 4, size
        at += 4 + size
    first, size = places["channels"]
    names, place = [], first
    while data[place]:
        name, place = _text(data, place)
        names.append(name)
        place += _AFTER_NAME
    (begin,) = struct.unpack_from("<Q", data, at + 1)  # of the first block, behind the table of all
    last = max(struct.unpack_from(f"<{(begin - at - 1) // 8}Q", data, at + 1))
    if last + 8 + struct.unpack_from("<I", data, last + 4)[0] > len(data):
        raise ValueError
    return first, names


def _text(data: bytes, at: int) -> tuple[str, int]:
    """A text that ends with a zero, and where the next value begins."""
    end = data.index(b"\0", at)
    return data[at:end].decode("latin-1"), end + 1
