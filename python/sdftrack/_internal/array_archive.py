# SPDX-License-Identifier: MIT
"""Arrays in numpy's format, read with bounds: sizes are checked before memory is taken, and nothing is unpickled."""

from __future__ import annotations

import math
from io import BufferedIOBase
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

# What a file may expand to, so that a small one cannot take all memory.
MOST_EXPANSION = 10
ALLOWANCE_BYTES = 200_000_000
CHUNK_BYTES = 1 << 24
KINDS = "biuf"  # of numpy's dtypes: bool, integers, floating point


def may_hold(file_bytes: int, array_bytes: int) -> bool:
    """Whether a file of this size is read if its contents have `array_bytes`."""
    return array_bytes <= MOST_EXPANSION * file_bytes + ALLOWANCE_BYTES


def read_array(file: BinaryIO | BufferedIOBase, file_bytes: int) -> NDArray[Any]:
    """An array of numbers in numpy's format, whose file has `file_bytes`; writable and contiguous.

    ValueError, also where it declares more than the file has; whatever numpy raises for a header that is none.
    """
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    elif version == (2, 0):
        shape, fortran, dtype = np.lib.format.read_array_header_2_0(file)
    else:
        raise ValueError(f"an array of numpy's format {version}")
    if dtype.kind not in KINDS:
        raise ValueError(f"an array of {dtype}, not of numbers")
    declared = math.prod(shape) * dtype.itemsize
    if file.tell() + declared != file_bytes:
        raise ValueError(f"an array of {declared} bytes in a file of {file_bytes}")
    out = np.empty(shape[::-1] if fortran else shape, dtype)
    view = out.reshape(-1).view(np.uint8).data
    at = 0
    while at < len(view):
        piece = file.read(min(CHUNK_BYTES, len(view) - at))
        if not piece:
            raise EOFError("the end of the file within an array")
        view[at : at + len(piece)] = piece
        at += len(piece)
    return out.T if fortran else out
