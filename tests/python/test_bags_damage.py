# SPDX-License-Identifier: MIT
"""Damaged, closed and other files; which topics are chosen; memory and time."""

import time
import tracemalloc
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bag_writers import (
    COLOR_TOPIC,
    DEPTH_FRAME,
    DEPTH_TOPIC,
    T0_NS,
    image,
    info,
    millimetres,
    recording,
    write,
    write_mcap,
)
from test_bags import CAMERA, scene

import sdftrack as st

CHUNKS = {"chunk_size": 60_000}  # bytes: of a cut file all but the last are whole
CUT = ("db3", "mcap-loose", "mcap-ros2", "protobuf", "json")
FRAMES = 12


def frames_of(kind: str) -> int:
    """More than a chunk of ROS 1."""
    return 80 if kind.startswith("ros1") else FRAMES


def written(folder: Path, kind: str) -> Path:
    messages = recording(scene(frames=frames_of(kind)))
    if kind in ("mcap-ros2", "protobuf", "json"):
        return write_mcap(folder / "bag.mcap", messages, kind, **CHUNKS)
    return write(folder, messages, kind)


def file_of(path: Path) -> Path:
    return path if path.is_file() else next(p for p in path.iterdir() if p.suffix in (".db3", ".mcap"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", CUT)
def test_what_is_whole_of_a_cut_recording_is_read(tmp_path, kind):
    """At 20 random places: the first frames as they were recorded, or one clear error; one warning."""
    whole = scene(frames=frames_of(kind))
    file = file_of(written(tmp_path, kind))
    data, found = file.read_bytes(), []
    for seed in range(20):
        file.write_bytes(data[: int(np.random.default_rng(seed).integers(1, len(data) - 1))])
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            try:
                seq = st.open_sequence(file)
            except ValueError as error:  # cut before the first image, or its camera
                found.append(0 if str(file) in str(error) else -1)
                continue
        with seq:
            cuts = [w for w in told if "what is whole is used" in str(w.message)]
            assert len(cuts) == 1
            frames = [frame for frame in seq if not frame.error]
            found.append(len(frames))
            for frame, original in zip(frames, whole, strict=False):
                np.testing.assert_array_equal(frame.depth, original.depth)
                if frame.color is not None:
                    np.testing.assert_array_equal(frame.color, original.color)
    assert min(found) >= 0  # every error names the file
    assert len(set(found)) > 2  # cut at different places, with different parts left


@pytest.mark.parametrize("kind", ["ros1", "ros1-lz4", "ros1-bz2"])
def test_of_a_bag_without_a_whole_index_the_tool_that_repairs_it_is_named(tmp_path, kind):
    file = written(tmp_path, kind)
    data = file.read_bytes()
    for size in (100, len(data) // 2, len(data) - 1):
        file.write_bytes(data[:size])
        with pytest.raises(
            ValueError, match=r"bag\.bag: the bag has no whole index.*: rosbag reindex bag\.bag$"
        ):
            st.open_sequence(file)


@pytest.mark.parametrize("kind", ["ros1-lz4", "ros1-bz2", "mcap-ros2"])
def test_a_damaged_chunk_is_a_few_bad_frames(tmp_path, kind):
    path = written(tmp_path, kind)
    data = bytearray(path.read_bytes())
    at = len(data) * 3 // 4  # not the first chunk
    end = at + (4000 if kind == "mcap-ros2" else 100_000)  # more than a block of lz4, which has no checksum
    data[at:end] = bytes(b ^ 255 for b in data[at:end])
    path.write_bytes(data)
    with st.open_sequence(path) as seq:
        errors = [frame.error for frame in seq]
    assert len(errors) == frames_of(kind)
    assert any(errors)
    assert not all(errors)


@pytest.mark.parametrize("suffix", [".bag", ".db3", ".mcap"])
def test_empty_and_other_files_are_named(tmp_path, suffix):
    file = tmp_path / f"x{suffix}"
    file.write_bytes(b"")
    with pytest.raises(ValueError, match=rf"x\{suffix}: the file is empty"):
        st.open_sequence(file)
    file.write_bytes(b"something else" * 100)
    with pytest.raises(ValueError, match=rf"x\{suffix}: expected .*got another file"):
        st.open_sequence(file)


def test_a_recording_without_depth_lists_its_topics(tmp_path):
    messages = [m for m in recording(scene()) if m.topic == COLOR_TOPIC]
    with pytest.raises(ValueError, match=r"no depth images.*color/image_raw \(sensor_msgs/msg/Image, 6\)"):
        st.open_sequence(write(tmp_path, messages, "ros1"))


def test_of_several_topics_one_must_be_named(tmp_path):
    messages = recording(scene())
    twin = [replace(m, topic="/other/depth/image") for m in messages if m.topic == DEPTH_TOPIC]
    color = [replace(m, topic="/other/color/image") for m in messages if m.topic == COLOR_TOPIC]
    path = write(tmp_path, messages + twin + color, "db3")
    with pytest.raises(ValueError, match=r"depth_topic: .*depth/image_raw.*, /other/depth/image \("):
        st.open_sequence(path)
    with pytest.raises(ValueError, match=r"color_topic: .*color/image_raw.*, /other/color/image \("):
        st.open_sequence(path, depth_topic=DEPTH_TOPIC)
    with st.open_sequence(path, depth_topic=DEPTH_TOPIC, color_topic="/other/color/image") as seq:
        np.testing.assert_array_equal(seq[2].color, scene()[2].color)
    with pytest.raises(ValueError, match=r"depth_topic: expected .*got '/nothing'.*depth/image_raw"):
        st.open_sequence(path, depth_topic="/nothing")
    with pytest.raises(ValueError, match=r"color_topic: expected .*got '/tf'.*color/image_raw"):
        st.open_sequence(path, depth_topic=DEPTH_TOPIC, color_topic="/tf")


def test_infrared_and_compressed_copies_are_not_chosen(tmp_path):
    messages = recording(scene())
    depth = [m for m in messages if m.topic == DEPTH_TOPIC]
    messages += [replace(m, topic="/camera/infra1/image_raw") for m in depth]
    messages += [replace(m, topic=f"{DEPTH_TOPIC}/compressed") for m in depth]
    with st.open_sequence(write(tmp_path, messages, "ros1")) as seq:
        np.testing.assert_array_equal(seq[1].depth, scene()[1].depth)


def test_a_missing_camera_is_an_error(tmp_path):
    messages = [m for m in recording(scene()) if m.topic in (DEPTH_TOPIC, COLOR_TOPIC)]
    with pytest.raises(ValueError, match=r"no camera of /camera/depth/image_raw.*cameras: none"):
        st.open_sequence(write(tmp_path, messages, "ros1"))


@pytest.mark.parametrize("lens", [(0.0,) * 4, (0.1, 0.01, 0.0, 0.0)])
def test_a_fisheye_lens_is_refused_also_if_it_is_all_zero(tmp_path, lens):
    camera = info("/camera/depth/camera_info", T0_NS, DEPTH_FRAME, CAMERA, "equidistant", d=np.array(lens))
    picture = image(DEPTH_TOPIC, T0_NS, DEPTH_FRAME, millimetres(scene()[0]), "16UC1")
    with pytest.raises(ValueError, match=r"depth/camera_info: distortion_model.*equidistant"):
        st.open_sequence(write(tmp_path, [camera, picture], "db3"))


def test_rectified_images_have_the_camera_in_P(tmp_path):
    bent = st.Camera(70, 71, 39.5, 29.5, 80, 60, (0.1, 0, 0, 0, 0))
    P = np.array([65.0, 0, 40, 0, 0, 66, 30, 0, 0, 0, 1, 0])
    camera = info("/camera/depth/camera_info", T0_NS, DEPTH_FRAME, bent, p=P)
    for n, (name, expected) in enumerate(
        {"image_raw": bent, "image_rect": st.Camera(65, 66, 40, 30, 80, 60)}.items()
    ):
        picture = image(f"/camera/depth/{name}", T0_NS, DEPTH_FRAME, millimetres(scene()[0]), "16UC1")
        with st.open_sequence(write(tmp_path, [camera, picture], "ros1", f"bag{n}")) as seq:
            assert seq.camera.depth == expected


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ros1", "ros1-lz4", "db3", "ros2-mcap", "mcap-loose", "protobuf"])
def test_a_large_recording_takes_little_memory_and_5_ms_per_frame(tmp_path, kind):
    camera = st.Camera(600, 600, 319.5, 239.5, 640, 480)
    units = np.random.default_rng(0).integers(500, 3000, camera.shape).astype(np.uint16)
    messages = [info("/camera/depth/camera_info", T0_NS, DEPTH_FRAME, camera)]
    messages += [image(DEPTH_TOPIC, T0_NS + i * 33_333_333, DEPTH_FRAME, units, "16UC1") for i in range(60)]
    path = write(tmp_path, messages, kind)  # 37 MB
    with st.open_sequence(path) as seq:
        seq[0]
        taken = []
        for i in range(1, 60):
            start = time.perf_counter()
            assert seq[i].depth is not None
            taken.append(time.perf_counter() - start)
        print(f"{kind}: {1e3 * np.median(taken):.2f} ms per frame")
        if kind not in ("ros1-lz4", "protobuf"):  # those are decompressed
            assert np.median(taken) < 0.005 * 3  # three times what is promised: the machine may be busy
    tracemalloc.start()
    try:
        with st.open_sequence(path) as seq:
            for i in (30, 2, 59, 14):
                assert seq[i].depth is not None
        assert tracemalloc.get_traced_memory()[1] < 12e6
    finally:
        tracemalloc.stop()
