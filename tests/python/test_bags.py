# SPDX-License-Identifier: MIT
"""Bags as sequences, on the command line and as a camera: what was recorded comes back, whatever the format."""

from dataclasses import replace

import numpy as np
import pytest
from bag_writers import (
    COLOR_TOPIC,
    DEPTH_FRAME,
    DEPTH_TOPIC,
    FORMATS,
    T0_NS,
    image,
    info,
    layout_of,
    millimetres,
    recording,
    transform,
    write,
    write_ros2,
)

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.testing import assert_pose_close

CAMERA = st.Camera(70.0, 71.0, 39.5, 29.5, 80, 60)
COLOR_CAMERA = st.Camera(90.0, 91.0, 47.5, 35.5, 96, 72, (0.1, -0.05, 0.001, 0.002, 0.01))
T_COLOR_DEPTH = st.geometry.pose([0.01, -0.02, 0.005], [0.05, 0.001, -0.002])
FRAMES = 6


def scene(camera: st.Camera | st.RGBDCamera = CAMERA, frames: int = FRAMES, color_shape=None) -> st.Sequence:
    """Frames with noise of their own, so that no two can be taken for each other."""
    depth_camera = camera.depth if isinstance(camera, st.RGBDCamera) else camera
    made = []
    for i in range(frames):
        rng = np.random.default_rng(i)
        units = rng.integers(500, 3000, depth_camera.shape).astype(np.uint16)
        units[:5] = 0
        color = rng.integers(0, 256, (*(color_shape or depth_camera.shape), 3), np.uint8)
        made.append(st.Frame(units, color, depth_scale=0.001))
    return st.Sequence(made, camera)


def assert_same(seq: st.Sequence, whole: st.Sequence, numbers=None) -> None:
    for i in range(len(whole)) if numbers is None else numbers:
        frame = seq[i]
        assert frame.error == ""
        np.testing.assert_array_equal(frame.depth, whole[i].depth)
        np.testing.assert_array_equal(frame.color, whole[i].color)
        assert frame.timestamp == pytest.approx(1e-9 * (T0_NS + i * 33_333_333), abs=1e-6)
        assert frame.index == i


@pytest.mark.parametrize("kind", FORMATS)
def test_a_recording_comes_back_bit_by_bit(tmp_path, kind):
    whole = scene()
    path = write(tmp_path, recording(whole), kind)
    with st.open_sequence(path) as seq:
        assert seq.layout == layout_of(kind)
        assert len(seq) == FRAMES
        assert seq.camera == st.RGBDCamera(CAMERA)
        assert seq.name == "bag"
        assert_same(seq, whole)
        assert_same(seq, whole, [4, 1, 5, 0, 2, 2, 3])  # in any order
    with st.open_sequence(
        path, layout=layout_of(kind), depth_topic=DEPTH_TOPIC, color_topic=COLOR_TOPIC
    ) as seq:
        assert_same(seq, whole)


@pytest.mark.parametrize("kind", FORMATS)
def test_the_colour_camera_and_its_pose_come_from_the_recording(tmp_path, kind):
    rig = st.RGBDCamera(CAMERA, COLOR_CAMERA, T_color_depth=T_COLOR_DEPTH)
    whole = scene(rig, color_shape=COLOR_CAMERA.shape)
    path = write(tmp_path, recording(whole, T_COLOR_DEPTH), kind)
    with st.open_sequence(path) as seq:
        assert seq.camera.depth == CAMERA
        assert seq.camera.color == COLOR_CAMERA
        assert_pose_close(seq.camera.T_color_depth, T_COLOR_DEPTH, 1e-9, 1e-9)
        assert_same(seq, whole)


@pytest.mark.parametrize("kind", ["db3", "ros2-mcap"])
def test_a_file_of_a_ros2_folder_opens_alone(tmp_path, kind):
    folder = write(tmp_path, recording(scene()), kind)
    (file,) = [p for p in folder.iterdir() if p.suffix in (".db3", ".mcap")]
    with st.open_sequence(file) as seq:
        assert_same(seq, scene())
    (folder / "metadata.yaml").unlink()  # as after a crash of the recorder
    with st.open_sequence(folder) as seq:
        assert seq.layout == "ros2"
        assert_same(seq, scene())


def test_a_ros2_folder_of_several_files_is_one_sequence(tmp_path):
    messages = recording(scene())
    half = len(messages) // 2
    one, two = write_ros2(tmp_path / "one", messages[:half]), write_ros2(tmp_path / "two", messages[half:])
    folder = tmp_path / "whole"
    folder.mkdir()
    for n, part in enumerate((one, two)):
        (file,) = part.glob("*.db3")
        file.rename(folder / f"whole_{n}.db3")
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n"
        "    - whole_0.db3\n    - whole_1.db3\n  compression_format: ''\n  compression_mode: ''\n"
    )
    with st.open_sequence(folder) as seq:
        assert len(seq) == FRAMES
        assert_same(seq, scene())
    (folder / "whole_1.db3").unlink()
    with pytest.raises(ValueError, match=r"whole_1\.db3.*missing"):
        st.open_sequence(folder)


def test_a_folder_compressed_as_a_whole_says_what_to_do(tmp_path):
    folder = write_ros2(tmp_path / "bag", recording(scene()), "db3-file")
    with pytest.raises(ValueError, match="zstd -d"):
        st.open_sequence(folder)


def test_the_colour_nearest_in_time_is_taken_whenever_it_was_recorded(tmp_path):
    """The driver writes colour two frames after depth; only the times in the headers are those of the images."""
    messages = [
        replace(m, recorded=m.stamp + 75_000_000) if m.topic == COLOR_TOPIC else m for m in recording(scene())
    ]
    with st.open_sequence(write(tmp_path, messages, "ros1")) as seq:
        assert_same(seq, scene(), [5, 0, 3, 1, 2, 4])


def test_colour_beyond_half_a_frame_is_not_taken(tmp_path):
    messages = recording(scene(), color_delay_ns=0)
    gone = [m for m in messages if m.topic == COLOR_TOPIC][2]
    messages = [m for m in messages if m is not gone]
    with st.open_sequence(write(tmp_path, messages, "db3")) as seq:
        assert [frame.color is None for frame in seq] == [i == 2 for i in range(FRAMES)]
        assert_same(seq, scene(), [0, 1, 3, 4, 5])


def test_headers_without_a_time_take_that_of_recording(tmp_path):
    messages = [replace(m, stamp=0, recorded=m.time) for m in recording(scene(), color_delay_ns=0)]
    with st.open_sequence(write(tmp_path, messages, "ros1")) as seq:
        step = np.diff([frame.timestamp for frame in seq])
        assert step == pytest.approx([0.033333333] * (FRAMES - 1), abs=1e-6)


def test_colour_without_a_transform_is_left_out_with_a_warning(tmp_path):
    rig = st.RGBDCamera(CAMERA, COLOR_CAMERA, T_color_depth=T_COLOR_DEPTH)
    whole = scene(rig, color_shape=COLOR_CAMERA.shape)
    messages = [m for m in recording(whole, T_COLOR_DEPTH) if m.topic != "/tf_static"]
    path = write(tmp_path, messages, "db3")
    with pytest.warns(UserWarning, match=r"color/image_raw are ignored: no fixed transform.*depth_topic="):
        seq = st.open_sequence(path)
    assert seq.camera == st.RGBDCamera(CAMERA)
    assert seq[0].color is None
    seq.take_unregistered_color()
    np.testing.assert_array_equal(seq[1].color, whole[1].color)
    seq.close()
    with st.open_sequence(path, color_topic="none") as seq:  # no warning
        assert seq[0].color is None


def test_a_transform_that_moves_is_not_a_mapping(tmp_path):
    rig = st.RGBDCamera(CAMERA, COLOR_CAMERA, T_color_depth=T_COLOR_DEPTH)
    whole = scene(rig, color_shape=COLOR_CAMERA.shape)
    messages = [m for m in recording(whole, T_COLOR_DEPTH) if m.topic != "/tf_static"]
    for i in range(3):
        T = st.geometry.pose([0.01 * i, 0, 0], [0, 0, 0])
        messages.append(transform("color_optical", DEPTH_FRAME, T, T0_NS + i, topic="/tf"))
    with pytest.warns(UserWarning, match="no fixed transform"):
        st.open_sequence(write(tmp_path, messages, "ros1")).close()


def test_depth_aligned_to_colour_needs_no_transform(tmp_path):
    """The names of RealSense's driver; the depth topic's name says that it is aligned, whatever the frames."""
    whole, topic = scene(), "/camera/aligned_depth_to_color/image_raw"
    messages = []
    for i, frame in enumerate(whole):
        stamp = T0_NS + i * 33_333_333
        messages.append(info("/camera/aligned_depth_to_color/camera_info", stamp, "a", CAMERA))
        messages.append(image(topic, stamp, "a", millimetres(frame), "16UC1"))
        messages.append(info("/camera/color/camera_info", stamp, "b", CAMERA))
        messages.append(image(COLOR_TOPIC, stamp, "b", frame.color, "rgb8"))
    with st.open_sequence(write(tmp_path, messages, "ros2-mcap")) as seq:
        assert seq.camera == st.RGBDCamera(CAMERA)
        assert_same(seq, whole)


def test_a_closed_sequence_says_so(tmp_path):
    seq = st.open_sequence(write(tmp_path, recording(scene()), "db3"))
    frame = seq[0]
    part = seq[2:]
    part.close()
    seq.close()
    assert frame.depth is not None
    for one in (seq, part):
        with pytest.raises(ValueError, match="closed"):
            one[0]


def test_commands_take_topics(tmp_path, capsys):
    messages = recording(scene())
    messages += [replace(m, topic="/other/image") for m in messages if m.topic == DEPTH_TOPIC]
    words = ["convert", str(write(tmp_path, messages, "ros1")), "--to", "tum", "-q"]
    assert run([*words, "--out", str(tmp_path / "a")]) == 1
    assert "--depth-topic: " in capsys.readouterr().err
    topics = ["--depth-topic", DEPTH_TOPIC, "--color-topic", "none"]
    assert run([*words, *topics, "--out", str(tmp_path / "b")]) == 0
    assert [frame.color for frame in st.open_sequence(tmp_path / "b")] == [None] * FRAMES
