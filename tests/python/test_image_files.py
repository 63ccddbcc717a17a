# SPDX-License-Identifier: MIT
"""Image files whose header declares more than they hold."""

import struct
import zlib

import cv2
import numpy as np
import pytest
from measured_memory import peak_bytes

from sdftrack.io import frames
from sdftrack.io.frames import image_header


def _png(width: int, height: int, bits: int, color: int, rows: bytes) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, bits, color, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".bmp", ".pgm", ".ppm"])
@pytest.mark.parametrize("image", [np.full((24, 32), 7, np.uint8), np.full((25, 31, 3), 7, np.uint8)])
def test_the_size_in_the_header_is_that_of_the_pixels(suffix, image):
    if (suffix, image.ndim) in ((".pgm", 3), (".ppm", 2)):
        pytest.skip("the suffix says grey or colour")
    data = cv2.imencode(suffix, image)[1].tobytes()
    header = image_header(data)
    assert header.shape == image.shape[:2]
    assert header.decoded_bytes >= image.nbytes


@pytest.mark.parametrize("suffix", [".png", ".tif", ".pgm"])
def test_the_bytes_of_a_depth_image_are_those_of_16_bit(suffix):
    header = image_header(cv2.imencode(suffix, np.full((24, 32), 7, np.uint16))[1].tobytes())
    assert header.decoded_bytes >= 24 * 32 * 2


def test_a_header_that_is_cut_anywhere_is_none():
    for suffix in (".png", ".jpg", ".tif", ".bmp", ".pgm"):
        data = cv2.imencode(suffix, np.full((24, 32), 7, np.uint8))[1].tobytes()
        for end in range(min(len(data), 100)):
            header = image_header(data[:end])
            assert header is None or header.shape == (24, 32)


@pytest.mark.parametrize("read", [frames.read_depth_units, frames.read_color, frames.read_mask])
@pytest.mark.parametrize("size", [2**31 - 1, 30_000])
def test_a_small_file_of_a_large_image_is_refused_before_it_is_decoded(tmp_path, read, size):
    """The larger one is beyond OpenCV's own limit, the smaller one would take gigabytes."""
    path = tmp_path / "large.png"
    path.write_bytes(_png(size, size, 8, 2, zlib.compress(bytes(1_000_000))))
    with pytest.raises(ValueError, match=rf"large\.png: {size} x {size} pixels declared by a file of"):
        read(path)


def test_content_of_another_kind_is_refused(tmp_path):
    (tmp_path / "a.png").write_bytes(b"RIFF....WEBPVP8 ")
    with pytest.raises(ValueError, match=r"a\.png: not a readable image; expected PNG, JPEG"):
        frames.read_color(tmp_path / "a.png")


@pytest.mark.slow
def test_the_largest_image_that_is_read_takes_the_promised_memory(tmp_path):
    """10 times the file and 200 MB: of a picture that is compressed as well as PNG can, just below the limit."""
    width, height = 8192, 3890
    deflate = zlib.compressobj(9)
    row = bytes(1 + 3 * width)
    rows = b"".join(deflate.compress(row) for _ in range(height)) + deflate.flush()
    path = tmp_path / "large.png"
    path.write_bytes(_png(width, height, 8, 2, rows))
    peak = peak_bytes(
        f"frames.read_color({str(path)!r})", "import cv2, numpy; from sdftrack.io import frames"
    )
    assert peak <= 10 * path.stat().st_size + 200e6


def test_a_chunk_that_declares_more_than_the_file_has_is_refused_before_memory_is_taken(tmp_path):
    data = bytearray(_png(64, 48, 8, 2, zlib.compress(bytes(48 * (1 + 3 * 64)))))
    struct.pack_into(">I", data, 33, 2**31 - 1)  # of the pixels
    path = tmp_path / "a.png"
    path.write_bytes(data)
    before = "from sdftrack.io import frames; import cv2"
    code = f"""
try:
    frames.read_color({str(path)!r})
    raise SystemExit("read")
except ValueError as error:
    assert "truncated" in str(error), error
"""
    assert peak_bytes(code, before) < 100e6
