# SPDX-License-Identifier: MIT
"""RealSense's recordings: written by the SDK's own recorder, and compared with its own player."""

import sqlite3
from dataclasses import replace

import numpy as np
import pytest
from bag_writers import Message, image, info, write_ros1
from scipy.spatial.transform import Rotation
from test_realsense import COLOR, DEPTH, SCALE, START_S, frames

import sdftrack as st
from sdftrack.io.datasets.pairing import nearest_in_time
from support.software_realsense import PAUSE_S, SoftwareRealSense, record

pytest.importorskip("pyrealsense2", exc_type=ImportError, reason="needs the extra realsense")

TURN = st.geometry.exp([0.015, -0.001, 0.002, 0.2, -0.3, 0.4])
CAMERA = st.RGBDCamera(DEPTH, COLOR, T_color_depth=TURN)
COUNT = 8


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("realsense") / "recorded.db3"
    record(
        path,
        SoftwareRealSense(CAMERA, SCALE),
        [one.replace(color=None) if i == 5 else one for i, one in enumerate(frames(COUNT))],
    )
    return path


def expected(i):
    frame = frames(COUNT)[i]
    units = np.round(frame.depth / SCALE).astype(np.uint16)
    return st.Frame(units, None if i == 5 else frame.color, depth_scale=SCALE, check_units=False)


def test_a_recording_has_the_frames_bit_by_bit_in_any_order(recorded):
    with st.open_sequence(recorded) as seq:
        assert (seq.layout, seq.name, len(seq)) == ("realsense", "recorded", COUNT)
        for i in (3, 0, 7, 5, 4):
            np.testing.assert_array_equal(seq[i].depth, expected(i).depth)
            assert (seq[i].color is None) == (i == 5)
            if i != 5:
                np.testing.assert_array_equal(seq[i].color, expected(i).color)
            assert seq[i].timestamp == pytest.approx(START_S + i / 30, abs=1e-6)
        np.testing.assert_allclose(seq.camera.depth.K, DEPTH.K, rtol=1e-6)
        np.testing.assert_allclose(seq.camera.color.distortion, COLOR.distortion, rtol=1e-6)
        np.testing.assert_allclose(seq.camera.T_color_depth, TURN, atol=2e-6)  # six digits in the file


def test_a_recording_without_colour(tmp_path):
    camera = SoftwareRealSense(st.RGBDCamera(DEPTH), 0.001)
    record(tmp_path / "depth.db3", camera, frames(2))
    with st.open_sequence(tmp_path / "depth.db3") as seq:
        assert seq.camera.color is None
        assert [frame.color for frame in seq] == [None, None]


@pytest.fixture
def copy(recorded, tmp_path):
    """A copy of the recording that may be changed, and a function that does so."""
    path = tmp_path / "copy.db3"
    path.write_bytes(recorded.read_bytes())

    def change(*statements):
        with sqlite3.connect(path) as database:
            for statement in statements:
                database.execute(*statement) if isinstance(statement, tuple) else database.execute(statement)
        database.close()
        return path

    return change


OF_DEPTH = "(SELECT id FROM topics WHERE name LIKE '%Depth_0/image/data%')"


def test_a_damaged_image_is_a_frame_with_its_reason(copy):
    first = f"(SELECT MIN(id) FROM messages WHERE topic_id = {OF_DEPTH})"
    path = copy(f"UPDATE messages SET data = SUBSTR(data, 1, 500) WHERE id = {first}")
    with st.open_sequence(path) as seq:
        assert seq[0].depth is None
        assert seq[0].error.startswith("copy.db3, frame 0: /device_0/sensor_0/Depth_0/image/data")
        assert "cannot be decoded" in seq[0].error
        assert seq[1].error == ""


def test_missing_metadata_leaves_the_recorders_times(copy):
    path = copy(
        "DELETE FROM messages WHERE topic_id IN (SELECT id FROM topics WHERE name LIKE '%image/metadata')"
    )
    with st.open_sequence(path) as seq:
        stamps = [frame.timestamp for frame in seq]
    assert len(stamps) == COUNT
    assert np.all(np.diff(stamps) > 0.9 * PAUSE_S)
    assert stamps[-1] < 60  # since the recording began


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("DELETE FROM topics WHERE name LIKE '%Depth_0/image/data%'", "no depth stream.*its streams: Color"),
        (f"DELETE FROM messages WHERE topic_id = {OF_DEPTH}", "no depth images"),
        (
            "DELETE FROM topics WHERE name LIKE '%Depth_0/camera_info'",
            "no intrinsics in /device_0/sensor_0/Depth_0",
        ),
    ],
)
def test_what_a_recording_lacks_is_named(copy, statement, words):
    with pytest.raises(ValueError, match=words):
        st.open_sequence(copy(statement))


def test_unknown_units_and_colour_formats_are_warnings(copy):
    kind = (
        b"\0\1\0\0"
        + bytes(8)
        + b"\6\0\0\0Color\0\0\0"
        + b"\x1a\0\0\0YUYV; zstd; 96x72 step=19\0\0\0"
        + bytes(4)
    )
    path = copy(
        "DELETE FROM topics WHERE name LIKE '%Depth_Units/value'",
        (f"UPDATE messages SET data = ? WHERE topic_id = {OF_DEPTH.replace('Depth', 'Color')}", (kind,)),
    )
    with (
        pytest.warns(UserWarning, match="1 mm is assumed"),
        pytest.warns(UserWarning, match="colour images of format 'YUYV; zstd"),
    ):
        seq = st.open_sequence(path)
    assert seq[0].color is None
    seq.close()


def test_another_database_is_not_taken_for_a_recording(tmp_path):
    with sqlite3.connect(tmp_path / "other.db3") as database:
        database.execute("CREATE TABLE topics(id INTEGER, name TEXT, type TEXT)")
        database.execute("INSERT INTO topics VALUES (1, '/camera/depth', 'sensor_msgs/msg/Image')")
    database.close()
    (tmp_path / "text.db3").write_text("no database")
    for name in ("other.db3", "text.db3"):
        with pytest.raises(ValueError, match=r"expected a recording of layout realsense"):
            st.open_sequence(tmp_path / name, layout="realsense")


def test_nearest_times_against_a_search_of_all_pairs():
    noise = np.random.default_rng(0)
    for _ in range(50):
        a, b = (np.sort(noise.uniform(0, 1, noise.integers(1, 30))) for _ in range(2))
        periods = [np.median(np.diff(t)) for t in (a, b) if len(t) > 1]
        limit = 0.5 * max(periods, default=1 / 30)
        gaps = np.abs(a[:, None] - b[None])
        wanted = np.where(gaps.min(1) <= limit, gaps.argmin(1), -1)
        np.testing.assert_array_equal(nearest_in_time(a, b), wanted)


# -- the older .bag
STREAM_INFO = "uint32 fps\nstring encoding\nbool is_recommended\n"


def write_bag(path, count, compression="lz4", color_encoding="rgb8"):
    """A bag with the topics and types of the SDK's file format 2.2, by `rosbags`."""

    def first(topic, kind, **values):
        return Message(topic, kind, 1, "", values, recorded=1)

    def key_value(topic, at, key, value):
        return Message(
            topic, "diagnostic_msgs/msg/KeyValue", at, "", {"key": key, "value": value}, recorded=at
        )

    messages = [
        key_value("/device_0/info", 1, "Name", "Intel RealSense D435"),
        first("/device_0/sensor_0/option/Depth Units/value", "std_msgs/msg/Float32", data=SCALE),
    ]
    streams = ("/device_0/sensor_0/Depth_0", DEPTH, "mono16"), ("/device_0/sensor_1/Color_0", COLOR, "rgb8")
    for (stream, camera, encoding), T in zip(streams, (np.eye(4), TURN), strict=True):
        turned = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
        about = {"fps": 30, "encoding": encoding, "is_recommended": False}
        place = {
            "translation": ("geometry_msgs/msg/Vector3", T[:3, 3].tolist()),
            "rotation": ("geometry_msgs/msg/Quaternion", turned),
        }
        messages += [
            first(f"{stream}/info", "realsense_msgs/msg/StreamInfo", **about),
            replace(info(f"{stream}/info/camera_info", 0, "0", camera, "Brown Conrady"), recorded=1),
            first(f"{stream}/tf/0", "geometry_msgs/msg/Transform", **place),
        ]
    for i, frame in enumerate(frames(count)):
        at, stamp = 10**7 + i * 33_000_000, round(1e9 * (START_S + i / 30))
        units = np.round(frame.depth / SCALE).astype(np.uint16)
        color = frame.color if color_encoding == "rgb8" else frame.color[..., :2]
        images = (units, "mono16", 0), (color, color_encoding, 4_000_000)
        for (stream, _, _), (pixels, encoding, delay) in zip(streams, images, strict=True):
            taken = image(f"{stream}/image/data", stamp + delay, "0", pixels, encoding)
            messages.append(replace(taken, recorded=at))
    write_ros1(path, messages, compression, STREAM_INFO)


@pytest.mark.parametrize("compression", ["lz4", ""])
def test_a_bag_has_the_frames_bit_by_bit_in_any_order(tmp_path, compression):
    write_bag(tmp_path / "old.bag", 4, compression)
    with st.open_sequence(tmp_path / "old.bag") as seq:
        assert (seq.layout, len(seq)) == ("realsense", 4)
        for i in (2, 0, 3):
            frame = frames(4)[i]
            units = np.round(frame.depth / SCALE).astype(np.uint16)
            wanted = st.Frame(units, frame.color, depth_scale=SCALE, check_units=False)
            np.testing.assert_array_equal(seq[i].depth, wanted.depth)
            np.testing.assert_array_equal(seq[i].color, wanted.color)
            assert seq[i].timestamp == pytest.approx(START_S + i / 30, abs=1e-6)
        np.testing.assert_allclose(seq.camera.T_color_depth, TURN, atol=1e-9)
        np.testing.assert_allclose(seq.camera.color.distortion, COLOR.distortion, rtol=1e-6)


def test_of_a_cut_database_what_is_whole_is_used_and_said(recorded, tmp_path):
    content = recorded.read_bytes()
    path = tmp_path / "cut.db3"
    path.write_bytes(content[: int(0.7 * len(content))])
    with pytest.warns(UserWarning, match=r"cut\.db3: it is damaged.*what is whole is used: \d+ depth images"):
        seq = st.open_sequence(path)
    with seq:
        assert 1 <= len(seq) < COUNT
        np.testing.assert_array_equal(seq[0].depth, expected(0).depth)


def test_colour_of_a_bag_that_is_not_decoded_is_left_out_with_a_warning(tmp_path):
    write_bag(tmp_path / "old.bag", 2, color_encoding="yuv422")
    with pytest.warns(
        UserWarning, match="colour images of format 'yuv422' are ignored; record colour as RGB8"
    ):
        seq = st.open_sequence(tmp_path / "old.bag")
    assert seq[0].color is None
    seq.close()
