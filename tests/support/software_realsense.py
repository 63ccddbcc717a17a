# SPDX-License-Identifier: MIT
"""A RealSense without hardware: a software device of the SDK, fed with the frames of a sequence."""

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame

START_S = 1.7e9
PAUSE_S = 0.04  # between frames: the recorder drops what comes faster than it writes


class SoftwareRealSense:
    """A software device whose sensors deliver what it is fed with; all behind the USB cable is the SDK's own.

    `depth_scale`: metres per unit; `sizes`: (width, height, fps) of further depth profiles, in the lists only.
    """

    def __init__(
        self,
        camera: RGBDCamera,
        depth_scale: float = 0.001,
        serial: str = "000001",
        fps: int = 30,
        sizes: tuple[tuple[int, int, int], ...] = (),
    ) -> None:
        self._rs = rs = need("pyrealsense2", "realsense")
        self.camera, self.depth_scale, self._fed = camera, depth_scale, 0
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.name, "Intel RealSense D435")
        self.device.register_info(rs.camera_info.serial_number, serial)
        self._uids = iter(range(1, 100))
        self._depth_sensor = self.device.add_sensor("Stereo Module")
        self._depth_sensor.add_read_only_option(rs.option.depth_units, depth_scale)
        self._depth = self._add(self._depth_sensor, "depth", camera.depth, fps)
        all_depth = [self._depth]
        for width, height, rate in sizes:
            lens = Camera.from_fov(1.0, width, height)
            all_depth.append(self._add(self._depth_sensor, "depth", lens, rate))
        self._color_sensor = self._color = None
        if camera.color is not None:
            assert camera.T_color_depth is not None
            self._color_sensor = self.device.add_sensor("RGB Camera")
            self._color = self._add(self._color_sensor, "color", camera.color, fps)
            between = rs.extrinsics()
            between.rotation = camera.T_color_depth[:3, :3].T.ravel().tolist()  # column by column
            between.translation = camera.T_color_depth[:3, 3].tolist()
            for profile in all_depth:
                profile.register_extrinsics_to(self._color, between)

    def units(self, frame: Frame) -> NDArray[np.uint16]:
        """(H, W) uint16 depth of a frame in the device's units, rounded."""
        assert frame.depth is not None
        return np.round(frame.depth / self.depth_scale).astype(np.uint16)

    def feed(self, frame: Frame, stamp_s: float, color_delay_s: float = 0.0) -> None:
        """Deliver the frame's images, taken at `stamp_s` seconds; the colour image `color_delay_s` later."""
        if frame.depth is not None:
            self._send(self._depth_sensor, self._depth, self.units(frame), stamp_s)
        if frame.color is not None and self._color is not None:
            self._send(self._color_sensor, self._color, frame.color, stamp_s + color_delay_s)
        self._fed += 1

    def _add(self, sensor: Any, kind: str, camera: Camera, fps: int) -> Any:
        rs = self._rs
        stream = rs.video_stream()
        stream.type, stream.index, stream.uid = getattr(rs.stream, kind), 0, next(self._uids)
        stream.width, stream.height, stream.fps = camera.width, camera.height, fps
        stream.fmt, stream.bpp = (rs.format.z16, 2) if kind == "depth" else (rs.format.rgb8, 3)
        lens = rs.intrinsics()
        lens.width, lens.height, lens.fx, lens.fy = camera.width, camera.height, camera.fx, camera.fy
        lens.ppx, lens.ppy, lens.model = camera.cx, camera.cy, rs.distortion.brown_conrady
        lens.coeffs = [*camera.distortion, *[0.0] * 5][:5]
        stream.intrinsics = lens
        return sensor.add_video_stream(stream)

    def _send(self, sensor: Any, profile: Any, pixels: NDArray[Any], stamp_s: float) -> None:
        rs = self._rs
        image = rs.software_video_frame()
        image.pixels = np.ascontiguousarray(pixels)
        image.bpp = pixels.itemsize * (1 if pixels.ndim == 2 else 3)
        image.stride = image.bpp * pixels.shape[1]
        image.timestamp, image.domain = 1000 * stamp_s, rs.timestamp_domain.global_time
        image.frame_number, image.profile = self._fed, profile.as_video_stream_profile()
        image.depth_units = self.depth_scale if pixels.ndim == 2 else 0.0
        sensor.on_video_frame(image)


def record(path: Path, camera: SoftwareRealSense, frames: Iterable[Frame], pause_s: float = PAUSE_S) -> None:
    """Feed the frames, 30 a second by their times, through the SDK's own recorder."""
    rs = need("pyrealsense2", "realsense")
    recorder = rs.recorder(str(path), camera.device)
    queue, sensors = rs.frame_queue(50), recorder.query_sensors()
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles()[:1])
        sensor.start(queue)
    for i, frame in enumerate(frames):
        camera.feed(frame, START_S + i / 30, color_delay_s=0.004)
        time.sleep(pause_s)
    for sensor in sensors:
        sensor.stop()
        sensor.close()
    del sensor, sensors, recorder  # which finishes the file
