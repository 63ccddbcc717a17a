# SPDX-License-Identifier: MIT
"""A webcam: colour alone, by OpenCV."""

from __future__ import annotations

import math
import os
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack._internal.closing import closed_on_error
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.live.camera import CameraLost, register_camera

GUESSED_FOV_DEG = 60.0  # horizontal; common webcams have 55 to 70
FIRST_TRIES, TRIES = 30, 3  # reads that may fail in a row: while it warms up, later


class Webcam:
    """A camera without depth, for outlines and for tracking by colour alone; options as of `open_camera`. `device` is a
    number, "" for the first, or a device file. OSError: no such camera, or another program uses it. ValueError: a size
    or rate that it does not deliver, or intrinsics of another size."""

    _first: bool  # no image has arrived yet

    def __init__(
        self, device: str = "", *, width: int | None = None, height: int | None = None, fps: float | None = None,
        camera: Camera | str | os.PathLike[str] | None = None,
    ) -> None:  # fmt: skip
        self._device = _device(device)
        self._wanted = {"width": width, "height": height, "fps": fps}
        self.name = f"webcam {self._device}"
        self._capture: Any = None
        size = self._open()
        with closed_on_error(self):
            if camera is None:
                warnings.warn(
                    f"{self.name}: its intrinsics are not known: a horizontal field of view of {GUESSED_FOV_DEG:g} "
                    "degrees is assumed; pass camera= for poses in metres",
                    stacklevel=2,
                )
                camera = Camera.from_fov(math.radians(GUESSED_FOV_DEG), *size)
            elif not isinstance(camera, Camera):
                file = camera
                try:
                    camera = Camera.load(file, *size)  # some files hold no size
                except ValueError:
                    camera = Camera.load(file)  # of another size, which is told; or another error
            self.camera = RGBDCamera(camera)
            if (camera.width, camera.height) != size:
                raise ValueError(
                    f"camera: these intrinsics are of {camera.width} x {camera.height} pixels, but {self.name} "
                    f"delivers {size[0]} x {size[1]}; pass width= and height=, or intrinsics scaled to its images"
                )

    def read(self) -> Frame | None:
        for _ in range(FIRST_TRIES if self._first else TRIES):
            if self._capture is None or not self._capture.grab():
                continue
            stamp_s = time.time()  # before the image is decoded
            good, image = self._capture.retrieve()
            if good and image.shape[:2] == self.camera.depth.shape:
                self._first = False
                return Frame(None, np.asarray(image), stamp_s, color_order="bgr")
        raise CameraLost("it delivers no images; is the cable connected?")

    def reopen(self) -> None:
        self.close()
        try:
            self._open()
        except OSError as error:
            raise CameraLost(str(error)) from None
        except ValueError as error:  # another camera has taken its number
            self.close()
            raise CameraLost(str(error)) from None

    def close(self) -> None:
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()

    def _open(self) -> tuple[int, int]:
        import cv2

        present = _video_devices()
        file = Path(f"/dev/video{self._device}" if isinstance(self._device, int) else self._device)
        if present is not None and not file.exists():  # OpenCV would print to the terminal
            found = ", ".join(present) or "none"
            raise OSError(f"{self.name}: no such camera; the video devices here are: {found}")
        self._first = True
        self._capture = cv2.VideoCapture(self._device)
        if not self._capture.isOpened():
            self.close()
            raise OSError(f"{self.name}: it cannot be opened; does another program use it?")
        properties = {
            "width": cv2.CAP_PROP_FRAME_WIDTH, "height": cv2.CAP_PROP_FRAME_HEIGHT, "fps": cv2.CAP_PROP_FPS,
        }  # fmt: skip
        given = {name: value for name, value in self._wanted.items() if value is not None}
        for name, value in given.items():
            self._capture.set(properties[name], value)
        has = {name: self._capture.get(properties[name]) for name in given}
        if any(not math.isclose(has[name], value, rel_tol=0.01) for name, value in given.items()):
            self.close()
            delivered, asked = (", ".join(f"{k}={v:g}" for k, v in each.items()) for each in (has, given))
            raise ValueError(f"width, height, fps: {self.name} delivers {delivered}, got {asked}")
        width, height = (round(self._capture.get(properties[name])) for name in ("width", "height"))
        return width, height


def _device(text: str) -> int | str:
    if text == "" or text.isdecimal():
        return int(text or 0)
    if text.startswith("/dev/"):
        return text
    raise ValueError(f"webcam: expected a number or a device file, as in webcam:0, got {text!r}")


def _video_devices() -> list[str] | None:
    """Device files of cameras; None where the system does not have such files."""
    if not sys.platform.startswith("linux"):
        return None
    return sorted(str(path) for path in Path("/dev").glob("video*"))


register_camera("webcam", "number or device file, colour alone")(Webcam)
