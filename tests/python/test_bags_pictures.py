# SPDX-License-Identifier: MIT
"""Encodings of recorded images: every one comes back as metres or RGB."""

import struct
from dataclasses import replace

import cv2
import numpy as np
import pytest
from bag_writers import COLOR_TOPIC, DEPTH_FRAME, DEPTH_TOPIC, T0_NS, compressed, image, info, write

import sdftrack as st
from sdftrack.io.datasets.bags.pictures import decode_rvl

CAMERA = st.Camera(40.0, 40.0, 23.5, 17.5, 48, 36)
RNG = np.random.default_rng(0)
UNITS = RNG.integers(500, 3000, CAMERA.shape).astype(np.uint16)
UNITS[:4, 3:9] = 0
METRES = UNITS.astype(np.float32) / np.float32(1000)
RGB = RNG.integers(0, 256, (*CAMERA.shape, 3), np.uint8)
INFO = info("/camera/depth/camera_info", T0_NS, DEPTH_FRAME, CAMERA)


def png(pixels: np.ndarray) -> bytes:
    return cv2.imencode(".png", pixels)[1].tobytes()


def jpeg(bgr: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()


def opened(tmp_path, messages, kind="db3") -> st.Frame:
    with st.open_sequence(write(tmp_path, [INFO, *messages], kind)) as seq:
        frame = seq[0]
    assert frame.error == ""
    return frame


def depth_image(pixels=UNITS, encoding="16UC1", **also):
    return image(DEPTH_TOPIC, T0_NS, DEPTH_FRAME, pixels, encoding, **also)


def depth_file(data: bytes, text: str, topic: str = DEPTH_TOPIC):
    return compressed(topic, T0_NS, DEPTH_FRAME, data, text)


@pytest.mark.parametrize("kind", ["ros1", "db3", "protobuf", "json"])
@pytest.mark.parametrize("encoding", ["16UC1", "mono16", "32FC1"])
def test_raw_depth(tmp_path, encoding, kind):
    pixels = METRES if encoding == "32FC1" else UNITS
    frame = opened(tmp_path, [depth_image(pixels, encoding)], kind)
    np.testing.assert_array_equal(frame.depth, METRES)


def test_depth_of_32_bits_without_a_measurement_is_zero(tmp_path):
    pixels = METRES.copy()
    pixels[0, :4] = [np.nan, np.inf, -np.inf, -1]
    frame = opened(tmp_path, [depth_image(pixels, "32FC1")])
    assert frame.depth[0, :4].tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_big_endian_and_padded_rows(tmp_path, encoding):
    pixels = (UNITS.astype(">u2") if encoding == "16UC1" else METRES.astype(">f4")).view(np.uint8)
    padded = np.hstack([pixels, RNG.integers(0, 255, (CAMERA.height, 10), np.uint8)])
    last = padded.ravel()[:-10]  # drivers may leave out the padding of the last row
    for data in (padded.ravel(), last):
        message = depth_image(
            padded, encoding, width=CAMERA.width, step=padded.shape[1], is_bigendian=1, data=data
        )
        folder = tmp_path / str(len(data))
        folder.mkdir()
        np.testing.assert_array_equal(opened(folder, [message], "ros1").depth, METRES)


@pytest.mark.parametrize(
    ("encoding", "pixels"),
    [
        ("rgb8", RGB), ("bgr8", RGB[..., ::-1]), ("8UC3", RGB[..., ::-1]),
        ("rgba8", np.dstack([RGB, RGB[..., 0]])), ("bgra8", np.dstack([RGB[..., ::-1], RGB[..., 0]])),
        ("mono8", RGB[..., 0]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["ros1", "ros2-mcap", "protobuf"])
def test_raw_colour(tmp_path, encoding, pixels, kind):
    message = image(COLOR_TOPIC, T0_NS, DEPTH_FRAME, pixels, encoding)
    frame = opened(tmp_path, [depth_image(), message], kind)
    expected = np.repeat(RGB[..., :1], 3, axis=2) if encoding == "mono8" else RGB
    np.testing.assert_array_equal(frame.color, expected)


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
@pytest.mark.parametrize("value", [(200, 20, 60), (20, 200, 60), (20, 60, 200)])
def test_bayer_patterns(tmp_path, pattern, value):
    cells = [value["rgb".index(letter)] for letter in pattern]
    pixels = np.tile(np.array(cells, np.uint8).reshape(2, 2), (CAMERA.height // 2, CAMERA.width // 2))
    message = image(COLOR_TOPIC, T0_NS, DEPTH_FRAME, pixels, f"bayer_{pattern}8")
    frame = opened(tmp_path, [depth_image(), message])
    assert (frame.color == value).all()


@pytest.mark.parametrize("encoding", ["yuv422", "uyvy", "yuv422_yuy2", "yuyv"])
def test_yuv_images(tmp_path, encoding):
    """A plain green: Y 145, U 54, V 34 in the standard's narrow range."""
    cell = [54, 145, 34, 145] if encoding in ("yuv422", "uyvy") else [145, 54, 145, 34]
    pixels = np.tile(np.array(cell, np.uint8), (CAMERA.height, CAMERA.width // 2)).reshape(*CAMERA.shape, 2)
    message = image(COLOR_TOPIC, T0_NS, DEPTH_FRAME, pixels, encoding)
    frame = opened(tmp_path, [depth_image(), message], "ros1")
    assert np.abs(frame.color.astype(int) - [0, 255, 1]).max() <= 2


@pytest.mark.parametrize("kind", ["ros1", "db3", "protobuf", "json"])
@pytest.mark.parametrize(
    ("depth", "color"),
    [
        ("16UC1; png compressed", "rgb8; png compressed bgr8"),
        ("png", "png"),
        ("mono16; png compressed ", "png"),
    ],
)
def test_images_as_png(tmp_path, depth, color, kind):
    colored = compressed(COLOR_TOPIC, T0_NS, DEPTH_FRAME, png(RGB[..., ::-1]), color)
    frame = opened(tmp_path, [depth_file(png(UNITS), depth), colored], kind)
    np.testing.assert_array_equal(frame.depth, METRES)
    np.testing.assert_array_equal(frame.color, RGB)


def test_colour_as_jpeg(tmp_path):
    smooth = np.ascontiguousarray(cv2.resize(RGB[:3, :4], CAMERA.shape[::-1]))
    data = jpeg(smooth[..., ::-1])
    message = compressed(f"{COLOR_TOPIC}/compressed", T0_NS, DEPTH_FRAME, data, "rgb8; jpeg compressed bgr8")
    frame = opened(tmp_path, [depth_image(), message])
    # as exact as JPEG is; red and blue not swapped
    assert np.abs(frame.color.astype(int) - smooth).mean() < 3


def header(a: float = 0.0, b: float = 0.0) -> bytes:
    return struct.pack("<iff", 0, a, b)


def quantised(metres: np.ndarray, z0: float = 100.0, most: float = 10.0) -> tuple[bytes, np.ndarray]:
    """As the transport's encoder: a / depth + b in 16 bits."""
    a = z0 * (z0 + 1)
    b = 1 - a / most
    with np.errstate(divide="ignore"):
        units = np.where(metres > 0, a / metres + b, 0)
    return header(a, b), np.clip(units, 0, 65535).astype(np.uint16)


def rvl(units: np.ndarray) -> bytes:
    """The encoder of the paper, one number after the other."""
    groups: list[int] = []

    def put(value: int) -> None:
        while True:
            group, value = value & 7, value >> 3
            groups.append(group | (8 if value else 0))
            if not value:
                return

    flat, i, previous = units.ravel().astype(int).tolist(), 0, 0
    while i < len(flat):
        start = i
        while i < len(flat) and flat[i] == 0:
            i += 1
        put(i - start)
        start = i
        while i < len(flat) and flat[i] != 0:
            i += 1
        put(i - start)
        for value in flat[start:i]:
            delta = value - previous
            put((delta << 1) ^ (delta >> 63))
            previous = value
    groups += [0] * (-len(groups) % 8)
    words = [int("".join(f"{g:x}" for g in groups[n : n + 8]), 16) for n in range(0, len(groups), 8)]
    return struct.pack("<II", units.shape[1], units.shape[0]) + struct.pack(f"<{len(words)}I", *words)


@pytest.mark.parametrize(
    ("encoding", "text", "encoded"),
    [
        ("16UC1", "16UC1; compressedDepth", png), ("16UC1", "16UC1; compressedDepth png", png),
        ("32FC1", "32FC1; compressedDepth png", png), ("16UC1", "16UC1; compressedDepth rvl", rvl),
        ("32FC1", "32FC1; compressedDepth rvl", rvl),
    ],
)  # fmt: skip
def test_compressed_depth(tmp_path, encoding, text, encoded):
    start, units = (header(), UNITS) if encoding == "16UC1" else quantised(METRES)
    message = depth_file(start + encoded(units), text, f"{DEPTH_TOPIC}/compressedDepth")
    found = opened(tmp_path, [message], "ros1").depth
    np.testing.assert_array_equal(found == 0, METRES == 0)
    if encoding == "16UC1":
        np.testing.assert_array_equal(found, METRES)
    else:  # one step of the quantisation at depth z is z^2 / a
        assert (np.abs(found - METRES) <= METRES**2 / 10_000 + 1e-6).all()


@pytest.mark.parametrize("seed", range(20))
def test_a_damaged_rvl_image_is_an_error_or_an_image(seed):
    rng = np.random.default_rng(seed)
    data = bytearray(rvl(UNITS))
    with pytest.raises(ValueError, match="truncated"):
        decode_rvl(bytes(data[: int(rng.integers(0, len(data) - 8))]), "x")
    for at in rng.integers(8, len(data), 5):
        data[at] ^= 1 << int(rng.integers(8))
    said, shape = "", UNITS.shape
    try:
        shape = decode_rvl(bytes(data), "x").shape
    except ValueError as error:
        said = str(error)
    assert "RVL" in said or (not said and shape == UNITS.shape)


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (depth_image(height=100), "expected 100 rows"),
        (depth_image(step=10), "rows of 10"),
        (depth_image(RGB, "rgb8"), "expected depth encoded as"),
        (depth_image(UNITS[:20]), "48 x 20 pixels, but the camera has 48 x 36"),
        (depth_image(data=np.zeros(0, np.uint8)), "got 0 bytes"),
        (depth_image(encoding="16UC7"), "expected depth encoded as"),
        (image(COLOR_TOPIC, T0_NS, DEPTH_FRAME, RGB[:10], "rgb8"), "48 x 10 pixels"),
    ],
)
def test_a_bad_image_in_the_middle_is_one_bad_frame(tmp_path, bad, reason):
    stamps = [T0_NS + i * 10**7 for i in range(4)]
    whole = {DEPTH_TOPIC: depth_image(), COLOR_TOPIC: image(COLOR_TOPIC, T0_NS, DEPTH_FRAME, RGB, "rgb8")}
    messages = [
        replace(bad if (topic, i) == (bad.topic, 2) else message, stamp=stamp)
        for topic, message in whole.items()
        for i, stamp in enumerate(stamps)
    ]
    with st.open_sequence(write(tmp_path, [INFO, *messages], "ros1")) as seq:
        assert [frame.error == "" for frame in seq] == [True, True, False, True]
        assert reason in seq[2].error
        assert bad.topic in seq[2].error
        assert seq[2].timestamp == pytest.approx(1e-9 * stamps[2], abs=1e-6)
        assert seq[2].index == 2


def test_depth_in_a_wrong_unit_shows_when_the_bag_is_opened(tmp_path):
    message = depth_image(METRES * 1000, "32FC1")
    with pytest.raises(ValueError, match=r"depth/image_raw: .*median.*millimetres"):
        st.open_sequence(write(tmp_path, [INFO, message], "ros1"))
