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
_CHANNELS = b"channels\0chlist\0"
_AFTER_NAME = 16  # bytes of a channel: type, whether linear, sampling


def decode_exr(data: bytes, name: str) -> NDArray[np.float32]:
    """(H, W) float32 of the content of a file; ValueError for several channels or damage, ImportError without PyAV."""
    av: Any = need("av", "video")
    at, channels = _channels(data, name)
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


def _channels(data: bytes, name: str) -> tuple[int, list[str]]:
    """Where the name of the first channel begins, and the names of all."""
    start = data.find(_CHANNELS)
    try:
        if start < 0:
            raise IndexError("no list of channels")
        first = at = start + len(_CHANNELS) + 4
        (size,) = struct.unpack_from("<I", data, at - 4)
        names, end = [], at + size - 1  # a zero ends the list
        while at < end:
            zero = data.index(b"\0", at, end)
            names.append(data[at:zero].decode("latin-1"))
            at = zero + 1 + _AFTER_NAME
    except (struct.error, IndexError, ValueError):
        raise ValueError(f"{name}: the EXR file is truncated or damaged") from None
    return first, names
