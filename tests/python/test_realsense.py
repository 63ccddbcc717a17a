# SPDX-License-Identifier: MIT
"""RealSense cameras, live: the SDK's software device in place of the hardware, everything else as it is."""

import threading

import numpy as np
import pytest

import sdftrack as st
from sdftrack.live import open_camera
from sdftrack.live.realsense import Pairing, RealSense
from support.software_realsense import SoftwareRealSense

rs = pytest.importorskip("pyrealsense2", exc_type=ImportError, reason="needs the extra realsense")

DEPTH = st.Camera(70.0, 71.0, 40.5, 29.0, 80, 60)
COLOR = st.Camera(90.0, 90.0, 47.5, 35.5, 96, 72, (0.1, -0.05, 0.001, 0.002, 0.01))
TURN = st.geometry.exp([0.015, -0.001, 0.002, 0.01, -0.02, 0.03])
CAMERA = st.RGBDCamera(DEPTH, COLOR, T_color_depth=TURN)
SCALE = 0.00025
START_S = 1.7e9  # an absolute time in seconds keeps 0.2 us in a float64 of milliseconds


def frames(count, seed=0):
    noise = np.random.default_rng(seed)
    return [
        st.Frame(
            (SCALE * noise.integers(1200, 12000, DEPTH.shape)).astype(np.float32),
            noise.integers(0, 256, (*COLOR.shape, 3)).astype(np.uint8),
        )
        for _ in range(count)
    ]


def plug_in(monkeypatch, *cameras):
    """Make these the connected cameras; the list can be changed."""
    devices = [camera.device for camera in cameras]
    monkeypatch.setattr("sdftrack.live.realsense.connected", lambda rs: list(devices))
    return devices


@pytest.fixture
def camera():
    return SoftwareRealSense(CAMERA, SCALE, sizes=((80, 60, 90), (40, 30, 30)))


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr("sdftrack.live.realsense.FIRST_S", 0.5)


def expected(camera, frame):
    """What a driver has to make of the device's units: the same as of files."""
    return st.Frame(camera.units(frame), frame.color, depth_scale=SCALE, check_units=False)


def assert_same(got, wanted):
    np.testing.assert_array_equal(got.depth, wanted.depth)
    if wanted.color is None:
        assert got.color is None
    else:
        np.testing.assert_array_equal(got.color, wanted.color)


def test_frames_arrive_bit_by_bit_with_their_times(camera, monkeypatch):
    plug_in(monkeypatch, camera)
    with open_camera("realsense:", waiting=20) as live:  # 14 images, which fit into the queue
        for i, frame in enumerate(frames(7)):
            camera.feed(frame, START_S + i / 30, color_delay_s=0.004)
        got = [live.next(timeout_s=5) for _ in range(7)]
    for i, (one, frame) in enumerate(zip(got, frames(7), strict=True)):
        assert_same(one, expected(camera, frame))
        assert one.timestamp == pytest.approx(START_S + i / 30, abs=1e-6)
        assert one.index == i
    assert live.dropped == 0


def test_without_colour_depth_does_not_wait_for_it(camera, monkeypatch):
    plug_in(monkeypatch, camera)
    with open_camera("realsense:", color=False) as live:
        camera.feed(frames(1)[0], START_S)
        got = live.next(timeout_s=5)
    assert got.color is None
    assert live.camera == st.RGBDCamera(live.camera.depth)
    assert_same(got, expected(camera, frames(1)[0].replace(color=None)))


def test_aligned_colour_lies_where_the_mapping_says(monkeypatch):
    ideal = st.RGBDCamera(DEPTH, st.Camera(90.0, 90.0, 47.5, 35.5, 96, 72), T_color_depth=TURN)
    camera = SoftwareRealSense(ideal, SCALE)
    plug_in(monkeypatch, camera)
    v, u = np.mgrid[: COLOR.height, : COLOR.width]
    ramp = np.stack([2 * u, 2 * v, 0 * u], -1).astype(np.uint8)  # the colour tells its own pixel
    frame = st.Frame(np.full(DEPTH.shape, 1.0, np.float32), ramp)
    with open_camera("realsense:", align=True) as live:
        camera.feed(frame, START_S)
        got = live.next(timeout_s=5)
    assert live.camera.aligned
    assert got.color.shape == (*DEPTH.shape, 3)
    np.testing.assert_array_equal(got.depth, expected(camera, frame).depth)
    px = ideal.project_to_color(DEPTH.back_project(got.depth))
    inside = (px > 2).all(-1) & (px < [COLOR.width - 3, COLOR.height - 3]).all(-1) & got.color.any(-1)
    assert inside.mean() > 0.5
    # rs.align takes a corner of the depth pixel's rectangle in the colour image, rounded: 0.65 + 0.5 px and less.
    assert np.abs(got.color[inside][:, :2] / 2 - px[inside]).max() < 1.3


def test_each_profile_is_found_by_its_size_and_rate(camera, monkeypatch):
    plug_in(monkeypatch, camera)
    for size in ((80, 60, 30), (80, 60, 90), (40, 30, 30)):
        source = RealSense(width=size[0], height=size[1], fps=size[2], color=False)
        assert (source.camera.depth.width, source.camera.depth.height) == size[:2]
        (active,) = source._sensors[0].get_active_streams()
        assert (active.as_video_stream_profile().width(), active.fps()) == (size[0], size[2])
        source.close()


@pytest.mark.parametrize(
    ("address", "options", "error", "words"),
    [
        ("realsense:77", {}, OSError, r"realsense:77: no camera has this serial.*D435 \(serial 000001\)"),
        (
            "realsense:", {"width": 641}, ValueError,
            "has depth of 40 x 30 at 30; 80 x 60 at 30, 90 frames per second, got width=641",
        ),
        ("realsense:", {"fps": 60, "width": 80}, ValueError, "got width=80, fps=60"),
        (
            "realsense:", {"preset": "High Accuracy"}, ValueError,
            "preset: expected one of none, for this camera",
        ),
    ],
)  # fmt: skip
def test_what_the_camera_does_not_have_is_refused(camera, monkeypatch, address, options, error, words):
    plug_in(monkeypatch, camera)  # fmt: skip
    with pytest.raises(error, match=words):
        open_camera(address, **options)


def test_no_camera_is_an_error_of_one_line():
    if list(rs.context().query_devices()):
        pytest.skip("a RealSense is connected")
    with pytest.raises(OSError, match=r"^realsense: no camera is connected; check the cable") as caught:
        open_camera("realsense:")
    assert "\n" not in str(caught.value)


def test_of_several_cameras_one_is_chosen_by_its_serial(camera, monkeypatch):
    plug_in(monkeypatch, camera, SoftwareRealSense(CAMERA, serial="000002"))
    with pytest.raises(
        ValueError, match=r"2 cameras are connected: .*000001.*000002.*as in realsense:000001"
    ):
        open_camera("realsense:")
    with open_camera("realsense:000002") as live:
        assert live.name == "RealSense D435 (serial 000002)"
        np.testing.assert_allclose(live.camera.depth.K, DEPTH.K, rtol=1e-6)
        np.testing.assert_allclose(live.camera.color.distortion, COLOR.distortion, rtol=1e-6)
        np.testing.assert_allclose(live.camera.T_color_depth, TURN, atol=1e-6)


def test_a_camera_in_use_says_so(camera, monkeypatch):
    plug_in(monkeypatch, camera)
    with open_camera("realsense:"), pytest.raises(OSError, match="000001\\): another program uses it"):
        open_camera("realsense:")
    with open_camera("realsense:") as again:  # released by the first one
        camera.feed(frames(1)[0], START_S)
        assert again.next(timeout_s=5).depth is not None


def test_a_camera_without_depth_is_refused(monkeypatch):
    device = rs.software_device()
    device.register_info(rs.camera_info.name, "Intel RealSense T265")
    device.register_info(rs.camera_info.serial_number, "9")
    monkeypatch.setattr("sdftrack.live.realsense.connected", lambda rs: [device])
    with pytest.raises(ValueError, match=r"T265 \(serial 9\): the camera has no depth stream"):
        open_camera("realsense:")


def test_presets_are_chosen_by_name_and_unknown_ones_listed():
    from types import SimpleNamespace

    from sdftrack.live.realsense import set_preset

    chosen = []
    names = {0: "Custom", 1: "Default", 3: "High Accuracy"}
    sensor = SimpleNamespace(
        supports=lambda option: option == rs.option.visual_preset,
        get_option_range=lambda option: SimpleNamespace(min=0.0, max=4.0),
        get_option_value_description=lambda option, value: names.get(value),
        set_option=lambda option, value: chosen.append((option, value)),
    )
    set_preset(rs, sensor, "high_accuracy")
    assert chosen == [(rs.option.visual_preset, 3)]
    with pytest.raises(ValueError, match="one of Custom, Default, High Accuracy, got 'High Density'"):
        set_preset(rs, sensor, "High Density")


def test_a_pulled_cable_gives_bad_frames_until_it_is_back(camera, monkeypatch):
    monkeypatch.setattr("sdftrack.live.realsense.SILENT_S", 0.1)
    monkeypatch.setattr("sdftrack.live.camera.RETRY_S", 0.02)
    devices = plug_in(monkeypatch, camera)
    with open_camera("realsense:", waiting=100) as live:
        camera.feed(frames(1)[0], START_S)
        assert live.next(timeout_s=5).error == ""
        device = devices.pop()
        assert live.next(timeout_s=5).error == (
            "RealSense D435 (serial 000001): no depth image for 0.1 s; is the cable connected?"
        )
        assert live.next(timeout_s=5).error.endswith("not connected")
        devices.append(device)
        stop = threading.Event()
        feeding = threading.Thread(target=keep_feeding, args=(camera, stop))
        feeding.start()
        try:
            # The sensors start one after the other: the first depth image may have no colour image yet.
            back = next(frame for frame in live if not frame.error and frame.color is not None)
        finally:
            stop.set()
            feeding.join()
    assert_same(back, expected(camera, frames(1)[0]))


def keep_feeding(camera, stop):
    i = 1
    while not stop.wait(0.01):
        camera.feed(frames(1)[0], START_S + i / 30)
        i += 1


def test_colour_on_another_clock_is_not_lost_silently(camera, monkeypatch):
    plug_in(monkeypatch, camera)
    source = RealSense()
    given = frames(1)[0]

    def read_one(i):
        camera.feed(given, START_S + i / 30, color_delay_s=5.0)
        return source.read()

    assert all(read_one(i).color is None for i in range(29))
    with pytest.warns(UserWarning, match="30 depth images in a row without a colour image"):
        assert read_one(29).color is None
    assert read_one(30).color is None
    source.close()


# -- pairing
def test_the_nearest_colour_is_taken_and_a_missing_one_is_noticed():
    pairing = Pairing(0.1)
    for i in range(4):
        pairing.depth.append((0.1 * i, f"d{i}"))
    for i in (0, 1, 3):
        pairing.color.append((0.1 * i + 0.03, f"c{i}"))
    got = [pairing.pop() for _ in range(5)]
    assert [one and one[1:] for one in got] == [
        ("d0", "c0"), ("d1", "c1"), ("d2", None), ("d3", "c3"), None,
    ]  # fmt: skip


def test_colour_that_comes_first_or_at_another_rate():
    pairing = Pairing(0.1)  # depth at 40 Hz, colour at 10 Hz, first
    pairing.color.append((0.0, "c0"))
    pairing.color.append((0.1, "c1"))
    for i in range(5):
        pairing.depth.append((0.025 * i, i))
    assert [pairing.pop()[2] for _ in range(5)] == ["c0", "c0", "c0", "c1", "c1"]


def test_depth_does_not_wait_for_ever():
    pairing = Pairing(0.1)
    got = []
    for i in range(6):
        pairing.depth.append((0.1 * i, i))
        got.append(pairing.pop())
    assert [one and one[1] for one in got] == [None, None, None, 0, 1, 2]
