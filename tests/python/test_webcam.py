# SPDX-License-Identifier: MIT
"""Webcams: a stand-in for OpenCV's capture, and what happens where there is no camera."""

import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import sdftrack as st
from sdftrack.live import CameraLost, open_camera
from sdftrack.live.webcam import Webcam

CAMERA = st.Camera(60.0, 60.0, 31.5, 23.5, 64, 48)


class Capture:
    """The part of cv2.VideoCapture that the driver uses; images are numbered by their blue channel."""

    opened, size = True, (64, 48)
    fixed_fps = None
    instances: list = []  # noqa: RUF012  (of each test, see `capture`)

    def __init__(self, device):
        self.device, self.count, self.released, self.unplugged = device, 0, False, False
        self.values = {
            cv2.CAP_PROP_FRAME_WIDTH: float(self.size[0]),
            cv2.CAP_PROP_FRAME_HEIGHT: float(self.size[1]),
            cv2.CAP_PROP_FPS: 30.0,
        }
        self.instances.append(self)

    def isOpened(self):
        return self.opened

    def get(self, what):
        return self.values[what]

    def set(self, what, value):
        if not (what == cv2.CAP_PROP_FPS and self.fixed_fps):
            self.values[what] = float(value)
        return True

    def grab(self):
        self.count += not self.unplugged
        return not self.unplugged

    def retrieve(self):
        h, w = (int(self.values[p]) for p in (cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FRAME_WIDTH))
        image = np.zeros((h, w, 3), np.uint8)
        image[..., 0] = self.count
        return True, image

    def release(self):
        self.released = True


@pytest.fixture
def capture(monkeypatch):
    class Fresh(Capture):
        instances: list = []  # noqa: RUF012

    monkeypatch.setattr(cv2, "VideoCapture", Fresh)
    monkeypatch.setattr("sdftrack.live.webcam._video_devices", lambda: None)
    return Fresh


def test_frames_are_rgb_without_depth(capture):
    with open_camera("webcam:", camera=CAMERA, waiting=50) as live:
        frame = live.next(timeout_s=5)
        assert live.camera == st.RGBDCamera(CAMERA)
    assert frame.depth is None
    assert frame.color.shape == (48, 64, 3)
    assert (frame.color[..., 2] > 0).all()
    assert not frame.color[..., :2].any()
    assert 0 <= live.age_s(frame) < 10
    assert capture.instances[0].device == 0
    assert capture.instances[0].released


@pytest.mark.parametrize(("address", "device"), [("webcam:2", 2), ("webcam:/dev/video7", "/dev/video7")])
def test_the_device_is_a_number_or_a_file(capture, address, device):
    with open_camera(address, camera=CAMERA):
        assert capture.instances[0].device == device


def test_intrinsics_from_a_file_and_a_size_of_choice(capture, tmp_path):
    CAMERA.scaled(2).save(tmp_path / "cam.json")
    with open_camera("webcam:0", width=128, height=96, camera=tmp_path / "cam.json") as live:
        assert live.camera.depth == CAMERA.scaled(2)
        assert live.next(timeout_s=5).color.shape == (96, 128, 3)


def test_unknown_intrinsics_are_guessed_with_a_warning(capture):
    with pytest.warns(UserWarning, match="webcam 0: its intrinsics are not known: .* 60 degrees is assumed"):
        source = Webcam()
    assert source.camera.depth == st.Camera.from_fov(np.radians(60), 64, 48)
    source.close()


def test_an_unplugged_webcam_gives_bad_frames_until_it_is_back(capture, monkeypatch):
    monkeypatch.setattr("sdftrack.live.camera.RETRY_S", 0.01)
    with open_camera("webcam:0", camera=CAMERA, waiting=500) as live:
        assert live.next(timeout_s=5).error == ""
        capture.opened = False
        capture.instances[0].unplugged = True
        assert "no images; is the cable connected" in next(frame for frame in live if frame.error).error
        assert "cannot be opened" in next(f for f in live if "no images" not in f.error).error
        capture.opened = True
        assert next(frame for frame in live if not frame.error).color is not None


@pytest.mark.parametrize(
    ("address", "options", "words"),
    [
        ("webcam:front", {}, "expected a number or a device file, as in webcam:0, got 'front'"),
        ("webcam:0", {"camera": CAMERA.scaled(2)}, "of 128 x 96 pixels, but webcam 0 delivers 64 x 48"),
        ("webcam:0", {"fps": 120}, "webcam 0 delivers fps=30, got fps=120"),
    ],
)
def test_what_it_does_not_have_is_refused(capture, address, options, words):
    capture.fixed_fps = True
    with pytest.raises(ValueError, match=words):
        open_camera(address, **{"camera": CAMERA, **options})
    assert all(one.released for one in capture.instances)


def test_another_camera_under_the_same_number_is_not_taken(capture):
    source = Webcam(camera=CAMERA)
    source.read()
    capture.instances[0].unplugged = True
    with pytest.raises(CameraLost):
        source.read()
    source.reopen()
    capture.instances[1].values[cv2.CAP_PROP_FRAME_WIDTH] = 100.0
    with pytest.raises(CameraLost):
        source.read()
    source.close()
    source.close()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="device files are Linux'")
def test_without_a_camera_the_devices_are_listed(capfd):
    free = next(n for n in range(64) if not Path(f"/dev/video{n}").exists())
    found = ", ".join(sorted(map(str, Path("/dev").glob("video*")))) or "none"
    with pytest.raises(OSError, match=f"webcam {free}: no such camera; the video devices here are: {found}"):
        open_camera(f"webcam:{free}", camera=CAMERA)
    assert capfd.readouterr() == ("", "")  # OpenCV has nothing to say
