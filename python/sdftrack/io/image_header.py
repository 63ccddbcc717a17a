# SPDX-License-Identifier: MIT
"""What the header of an image file declares, read before memory is taken for its pixels."""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass

__all__ = ["ImageHeader", "image_header", "png_is_whole"]

PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 4, 6: 4}  # of the colour types; OpenCV makes BGRA of grey with alpha
JPEG_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # markers of a frame's header, with the size
JPEG_ALONE = {0x01, *range(0xD0, 0xD9)}  # markers without a length
TIFF_WIDTH, TIFF_HEIGHT, TIFF_BITS, TIFF_SAMPLES = 256, 257, 258, 277
PNM = re.compile(rb"P[1-6](?:\s+|#[^\n]*\n)+(\d{1,9})(?:\s+|#[^\n]*\n)+(\d{1,9})\s")
PNM_MOST_BYTES = 6  # of a pixel: three channels of 16 bit


@dataclass(frozen=True)
class ImageHeader:
    """Size in pixels, and bytes of a decoded pixel."""

    width: int
    height: int
    pixel_bytes: int

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width), as of an array."""
        return self.height, self.width

    @property
    def decoded_bytes(self) -> int:
        return self.width * self.height * self.pixel_bytes


def image_header(data: bytes) -> ImageHeader | None:
    """The header of a PNG, JPEG, TIFF, BMP or PNM file; None for other content, and for a header that is cut."""
    try:
        if data.startswith(b"\x89PNG\r\n\x1a\n"):
            return _png(data)
        if data.startswith(b"\xff\xd8"):
            return _jpeg(data)
        if data[:4] in (b"II*\0", b"MM\0*"):
            return _tiff(data)
        if data.startswith(b"BM"):
            return _bmp(data)
        if pnm := PNM.match(data[:1024]):
            return ImageHeader(int(pnm[1]), int(pnm[2]), PNM_MOST_BYTES)
    except (struct.error, IndexError):
        pass
    return None


def png_is_whole(data: bytes) -> bool:
    """Whether the chunks of a PNG file end with IEND within it; OpenCV takes memory for what a chunk declares."""
    at = 8
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        at += 12 + length
        if kind == b"IEND":
            return at <= len(data)
    return False


def _png(data: bytes) -> ImageHeader | None:
    length, kind, width, height, bits, color = struct.unpack_from(">I4sIIBB", data, 8)
    if length != 13 or kind != b"IHDR" or color not in PNG_CHANNELS:
        return None
    return ImageHeader(width, height, PNG_CHANNELS[color] * math.ceil(bits / 8))


def _jpeg(data: bytes) -> ImageHeader | None:
    at = 2
    while True:
        if data[at] != 0xFF:
            return None
        marker = data[at + 1]
        if marker == 0xFF:  # filling
            at += 1
        elif marker in JPEG_ALONE:
            at += 2
        elif marker in JPEG_FRAMES:
            _, bits, height, width, channels = struct.unpack_from(">HBHHB", data, at + 2)
            return ImageHeader(width, height, channels * math.ceil(bits / 8))
        else:
            at += 2 + struct.unpack_from(">H", data, at + 2)[0]


def _tiff(data: bytes) -> ImageHeader | None:
    """The first directory; a value is in its entry, or the entry has the place of several (bits per sample)."""
    order = "<" if data[:2] == b"II" else ">"
    (at,) = struct.unpack_from(order + "I", data, 4)
    (count,) = struct.unpack_from(order + "H", data, at)
    found = {TIFF_BITS: 1, TIFF_SAMPLES: 1}
    for n in range(count):
        tag, kind, values = struct.unpack_from(order + "HHI", data, at + 2 + 12 * n)
        if kind not in (3, 4):  # 16 and 32 bit
            continue
        form = "H" if kind == 3 else "I"
        place = at + 10 + 12 * n
        if values * struct.calcsize(order + form) > 4:
            (place,) = struct.unpack_from(order + "I", data, place)
        (found[tag],) = struct.unpack_from(order + form, data, place)
    if TIFF_WIDTH not in found or TIFF_HEIGHT not in found:
        return None
    return ImageHeader(
        found[TIFF_WIDTH], found[TIFF_HEIGHT], found[TIFF_SAMPLES] * math.ceil(found[TIFF_BITS] / 8)
    )


def _bmp(data: bytes) -> ImageHeader | None:
    (size,) = struct.unpack_from("<I", data, 14)
    width, height = struct.unpack_from("<HH" if size == 12 else "<ii", data, 18)
    return ImageHeader(abs(width), abs(height), 4)
