# SPDX-License-Identifier: MIT
"""Compressed chunks: also the beginning of one whose end is missing, and the last few in memory."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from sdftrack._internal.extras import need

__all__ = ["LastChunks", "decompressed"]

KEPT = 2  # depth and colour may come from different chunks


def decompressed(data: bytes, compression: str) -> bytes:
    """The content of a chunk; of a damaged or cut one, as much as comes before the damage.

    ValueError for an unknown compression.
    """
    if compression in ("", "none"):
        return data
    make = _DECOMPRESSORS.get(compression)
    if make is None:
        raise ValueError(
            f"compression: expected {', '.join(_DECOMPRESSORS)} or none, got {compression!r}; "
            "convert the recording with its own tools"
        )
    try:
        content: bytes = make().decompress(data)
        return content
    except Exception:  # each library has its own
        pass
    decompressor, found = make(), bytearray()
    for start in range(0, len(data), 1 << 12):  # in pieces, to keep what comes before the damage
        try:
            found += decompressor.decompress(data[start : start + (1 << 12)])
        except Exception:
            break
    return bytes(found)


def _lz4() -> Any:
    return need("lz4.frame", "bags").LZ4FrameDecompressor()


def _zstd() -> Any:
    return need("zstandard", "bags").ZstdDecompressor().decompressobj()


def _bz2() -> Any:
    import bz2

    return bz2.BZ2Decompressor()


_DECOMPRESSORS: dict[str, Callable[[], Any]] = {"bz2": _bz2, "lz4": _lz4, "zstd": _zstd}


class LastChunks:
    """The contents of the chunks used last, so that neighbouring messages do not decompress them again."""

    def __init__(self, load: Callable[[int], bytes]) -> None:
        self._load = load
        self._kept: OrderedDict[int, bytes] = OrderedDict()

    def __getitem__(self, position: int) -> bytes:
        if position in self._kept:
            self._kept.move_to_end(position)
        else:
            while len(self._kept) >= KEPT:
                self._kept.popitem(last=False)
            self._kept[position] = self._load(position)
        return self._kept[position]

    def clear(self) -> None:
        self._kept.clear()
