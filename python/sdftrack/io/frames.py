# SPDX-License-Identifier: MIT
"""Depth, colour and mask images as files; the unit of 16-bit depth is defined by its layout."""

from __future__ import annotations

import io
import math
import os
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack._internal.files import replacing
from sdftrack._internal.saved_file import ALLOWANCE_BYTES, MOST_EXPANSION, may_hold, read_array
from sdftrack._internal.text_files import reason_of

_PNG_START, _JPEG_START, _JPEG_END = b"\x89PNG\r\n\x1a\n", b"\xff\xd8", b"\xff\xd9"
_NPY_START = b"\x93NUMPY"
HEADER_BYTES = 65536
_TAIL = 1024  # writers may put a few bytes after the end mark
_COPIES = 2.1  # of the pixels: OpenCV decodes into one and returns another; the rest is for the decoder
PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 4, 6: 4}  # of the colour types; OpenCV makes BGRA of grey with alpha
JPEG_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # markers of a frame's header, with the size
JPEG_ALONE = {0x01, *range(0xD0, 0xD9)}  # markers without a length
PNM = re.compile(rb"P[1-6](?:\s+|#[^\n]*\n)+(\d{1,9})(?:\s+|#[^\n]*\n)+(\d{1,9})\s")
PNM_MOST_BYTES = 6  # of a pixel: three channels of 16 bit


@dataclass(frozen=True)
class Expected:
    """The size that an image must have: of `whom` ("the camera"), (height, width)."""

    whom: str
    shape: tuple[int, int]

    def check(self, shape: tuple[int, ...], name: str) -> None:
        if tuple(shape[:2]) != tuple(self.shape):
            raise ValueError(
                f"{name}: {size_text(shape)} pixels, but {self.whom} has {size_text(self.shape)}"
            )


def size_text(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} x {shape[0]}"


def read_depth_units(
    path: str | os.PathLike[str], name: str | None = None, expected: Expected | None = None
) -> NDArray[np.uint16] | NDArray[np.float32]:
    """(H, W) raw units of a depth image; `name` identifies the file in messages. uint16, or float32 of a file of
    floating-point numbers (TIFF, NPY, EXR), in whatever unit it has. FileNotFoundError when it is missing; ValueError
    when it is truncated, not an image, of 8 bit or of several channels, or not of the `expected` size, which is
    compared with the header before anything is decoded."""
    return decode_depth_units(_content(Path(path), name), name or str(path), expected)


def decode_depth_units(data: bytes, name: str, expected: Expected | None = None) -> NDArray[Any]:
    if data.startswith(_NPY_START):
        image = _npy(data, name)
    elif data.startswith(EXR_START):
        image = decode_exr(data, name)
    else:
        image = _decode(data, name, expected)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[..., 0]
    if expected is not None:
        expected.check(image.shape, name)
    if image.ndim == 2 and image.dtype.kind == "f":
        return np.ascontiguousarray(image, dtype=np.float32)
    wide = image.ndim == 2 and image.dtype.kind in "iu" and image.itemsize > 2 and image.size > 0
    if wide and image.min() >= 0 and image.max() <= np.iinfo(np.uint16).max:
        return image.astype(np.uint16)
    if image.dtype != np.uint16 or image.ndim != 2:
        channels = "one channel" if image.ndim == 2 else f"shape {image.shape}"
        why = "; 8-bit depth images do not contain the distances" if image.dtype.itemsize == 1 else ""
        raise ValueError(
            f"{name}: expected 16-bit depth in one channel, or floating-point numbers, got {image.dtype} with "
            f"{channels}{why}"
        )
    return image


def _npy(data: bytes, name: str) -> NDArray[Any]:
    try:
        return np.asarray(read_array(io.BytesIO(data), len(data)))
    except (ValueError, EOFError, OSError, SyntaxError, MemoryError) as error:
        raise ValueError(f"{name}: not a readable .npy file ({reason_of(error)})") from None


def header_size(path: Path) -> tuple[int, int] | None:
    """(height, width) of an image file by its first bytes, without decoding; None where they do not tell."""
    try:
        with path.open("rb") as file:
            header = image_header(file.read(HEADER_BYTES))
    except OSError:
        return None
    return None if header is None else header.shape


def read_color(
    path: str | os.PathLike[str], name: str | None = None, expected: Expected | None = None
) -> NDArray[np.uint8]:
    return decode_color(_content(Path(path), name), name or str(path), expected)


def decode_color(data: bytes, name: str, expected: Expected | None = None) -> NDArray[np.uint8]:
    image = _decode(data, name, expected)
    if image.dtype != np.uint8:
        raise ValueError(f"{name}: expected an 8-bit colour image, got {image.dtype}")
    if image.ndim == 2:
        return np.repeat(image[..., None], 3, axis=2)
    return np.ascontiguousarray(image[..., 2::-1])


def read_mask(path: str | os.PathLike[str], name: str | None = None) -> NDArray[np.bool_]:
    """(H, W) bool, true where any channel is not zero (alpha does not count)."""
    image = _decode(_content(Path(path), name), name or str(path))
    if image.ndim == 3:
        image = np.asarray(image[..., :3].any(axis=2))
    return np.asarray(image != 0)


def write_depth_units(path: str | os.PathLike[str], units: NDArray[np.uint16]) -> None:
    if units.dtype != np.uint16 or units.ndim != 2:
        raise TypeError(f"units: expected uint16 (H, W), got {units.dtype} {units.shape}")
    _encode(path, units)


def write_color(path: str | os.PathLike[str], color: NDArray[np.uint8]) -> None:
    if color.dtype != np.uint8 or color.ndim != 3 or color.shape[2] != 3:
        raise TypeError(f"color: expected uint8 (H, W, 3), got {color.dtype} {color.shape}")
    _encode(path, color[..., ::-1])


def write_mask(path: str | os.PathLike[str], mask: NDArray[np.bool_]) -> None:
    _encode(path, np.where(mask, np.uint8(255), np.uint8(0)))


def _content(path: Path, name: str | None) -> bytes:
    label = name or str(path)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise FileNotFoundError(f"{label}: the file is missing") from None
    except OSError as error:
        raise ValueError(f"{label}: cannot be read ({error.strerror})") from None


def _decode(data: bytes, name: str, expected: Expected | None = None) -> NDArray[Any]:
    import cv2

    # The decoders return half a picture for some cut files, so the end mark is looked for here.
    cut = data.startswith(_PNG_START) and not png_is_whole(data)
    cut = cut or (data.startswith(_JPEG_START) and _JPEG_END not in data[-_TAIL:])
    if cut or not data:
        raise ValueError(f"{name}: the image file is {'truncated' if data else 'empty'}")
    _check_header(data, name, expected)
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:  # of sizes beyond its own limits
        image = None
    if image is None:
        raise ValueError(f"{name}: not a readable image")
    if expected is not None:
        expected.check(image.shape, name)
    return np.asarray(image)


def _check_header(data: bytes, name: str, expected: Expected | None) -> None:
    """ValueError for content whose pixels are of another size or would take much more memory than its bytes."""
    header = image_header(data)
    if header is None:
        raise ValueError(f"{name}: not a readable image; expected PNG, JPEG, TIFF, BMP or PNM")
    if expected is not None:
        expected.check(header.shape, name)
    if not may_hold(len(data), int(_COPIES * header.decoded_bytes)):
        raise ValueError(
            f"{name}: {size_text(header.shape)} pixels declared by a file of {len(data) / 1e6:.3g} MB; at most "
            f"{MOST_EXPANSION / _COPIES:.2g} times its size and {ALLOWANCE_BYTES / _COPIES / 1e6:.0f} MB more are read"
        )


def _encode(path: str | os.PathLike[str], image: NDArray[Any]) -> None:
    import cv2

    path = Path(path)
    ok, data = cv2.imencode(path.suffix, np.ascontiguousarray(image))
    if not ok:
        raise ValueError(f"{path}: images of this kind cannot be written; use .png")
    with replacing(path) as temporary:
        temporary.write_bytes(data.tobytes())


TIFF_WIDTH, TIFF_HEIGHT, TIFF_BITS, TIFF_SAMPLES = 256, 257, 258, 277


@dataclass(frozen=True)
class ImageHeader:
    width: int
    height: int
    pixel_bytes: int

    @property
    def shape(self) -> tuple[int, int]:
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
    FFmpeg gives zeros for rows that are missing, which would be pixels without a measurement."""
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
    end = data.index(b"\0", at)
    return data[at:end].decode("latin-1"), end + 1
