# SPDX-License-Identifier: MIT
"""The few types of the CDR serialization that image messages of ROS 2 consist of."""

from __future__ import annotations

import struct

__all__ = ["CdrReader"]


class CdrReader:
    """Reads one serialized message from its start; ValueError where it ends too early.

    >>> CdrReader(bytes([0, 1, 0, 0, 3, 0, 0, 0]) + b"ab" + bytes(1)).string()
    'ab'
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < 4 or data[1] not in (0, 1):
            raise ValueError("not a serialized ROS 2 message")
        self._data, self._at = data, 4
        self._order = "<" if data[1] else ">"

    def uint32(self) -> int:
        self._at += -(self._at - 4) % 4  # aligned, counted from behind the header
        try:
            (value,) = struct.unpack_from(f"{self._order}I", self._data, self._at)
        except struct.error:
            raise ValueError("the message is cut") from None
        self._at += 4
        return int(value)

    def blob(self) -> bytes:
        """A sequence of bytes."""
        length = self.uint32()
        value = self._data[self._at : self._at + length]
        if len(value) < length:
            raise ValueError("the message is cut")
        self._at += length
        return value

    def string(self) -> str:
        return self.blob().rstrip(b"\0").decode("utf-8", errors="replace")
