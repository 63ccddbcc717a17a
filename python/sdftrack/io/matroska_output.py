# SPDX-License-Identifier: MIT
"""A Matroska file of one video track that is whole after every image, whatever happens."""

from __future__ import annotations

import struct
from pathlib import Path

from sdftrack.io.unbuffered import UnbufferedFile

__all__ = ["MatroskaOutput", "state_duration"]

OPEN = bytes.fromhex("01ffffffffffffff")  # the length of a segment that ends with the file
KEY = 0x80
MARK = bytes.fromhex("448988")  # Duration, of 8 bytes
SEARCHED = 1 << 12  # bytes at the beginning


class MatroskaOutput:
    """Writes packets into clusters of one packet each.

    Parameters
    ----------
    path : Path
    codec : str
    private : bytes
        The codec's description of the stream.
    coded, shown : (width, height)
        Pixels of the encoded images; those of them, from the upper left corner, that are shown.
    period_ms : int
        Usual time between images.
    """

    def __init__(
        self,
        path: Path,
        codec: str,
        private: bytes,
        coded: tuple[int, int],
        shown: tuple[int, int],
        period_ms: int,
    ) -> None:
        self._path, self._file = path, UnbufferedFile(path)
        kind = [(0x4286, 1), (0x42F7, 1), (0x42F2, 4), (0x42F3, 8)]
        header = _element(
            0x1A45DFA3,
            b"".join(_number(name, value) for name, value in kind)
            + _element(0x4282, b"matroska")
            + _number(0x4287, 4)
            + _number(0x4285, 2),
        )
        about = _element(
            0x1549A966,
            _number(0x2AD7B1, 1_000_000)  # times are in milliseconds
            + MARK + struct.pack(">d", 0.0)  # stated at the end
            + _element(0x4D80, b"sdftrack") + _element(0x5741, b"sdftrack"),
        )  # fmt: skip
        pixels = _number(0xB0, coded[0]) + _number(0xBA, coded[1])
        pixels += _number(0x54DD, coded[0] - shown[0]) + _number(0x54AA, coded[1] - shown[1])
        track = [(0xD7, 1), (0x73C5, 1), (0x83, 1), (0x9C, 0), (0x23E383, 1_000_000 * period_ms)]
        entry = b"".join(_number(name, value) for name, value in track)
        entry += _element(0x86, codec.encode()) + _element(0x63A2, private) + _element(0xE0, pixels)
        start = header + _bytes(0x18538067) + OPEN + about + _element(0x1654AE6B, _element(0xAE, entry))
        try:
            self._file.write(start)
        except BaseException:
            self._file.close()
            path.unlink(missing_ok=True)
            raise
        self._whole = self._file.tell()

    def add(self, time_ms: int, packet: bytes, key: bool) -> None:
        """Write a packet, completely or not at all."""
        block = b"\x81\0\0" + bytes([KEY if key else 0]) + packet  # track 1, at the time of the cluster
        try:
            self._file.write(_element(0x1F43B675, _number(0xE7, time_ms) + _element(0xA3, block)))
        except BaseException:
            self._file.truncate(self._whole)
            self._file.seek(self._whole)
            raise
        self._whole = self._file.tell()

    def finish(self, duration_ms: int) -> None:
        """State the duration, which says that the file is complete, and close it."""
        self._file.close()
        state_duration(self._path, duration_ms)

    def close(self) -> None:
        self._file.close()


def state_duration(path: Path, duration_ms: int) -> None:
    """Write the duration into a file of this kind, in its place."""
    with path.open("r+b") as file:
        at = file.read(SEARCHED).index(MARK) + len(MARK)
        file.seek(at)
        file.write(struct.pack(">d", duration_ms))


def _element(name: int, content: bytes) -> bytes:
    return _bytes(name) + (len(content) | 1 << 56).to_bytes(8, "big") + content


def _number(name: int, value: int) -> bytes:
    return _element(name, value.to_bytes(max(1, (value.bit_length() + 7) // 8), "big"))


def _bytes(name: int) -> bytes:
    return name.to_bytes((name.bit_length() + 7) // 8, "big")
