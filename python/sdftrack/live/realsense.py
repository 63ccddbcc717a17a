# SPDX-License-Identifier: MIT
"""A RealSense camera: raw depth and colour of its sensors, paired by their timestamps."""

from __future__ import annotations

import math
import time
import warnings
from collections import deque
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack.camera import RGBDCamera
from sdftrack.frame import Frame
from sdftrack.live.realsense_device import (
    choose,
    color_profile,
    connected,
    depth_profile,
    describe,
    info,
    set_preset,
)
from sdftrack.live.sources import CameraLost, register_camera

FIRST_S = 5.0  # a camera delivers its first image within so long: D400 take up to 2 s
SILENT_S = 1.0  # and every other one
WAITING = 16  # images of both sensors in the queue, several periods
COLORLESS = 30  # frames without colour in a row


class RealSense:
    """A running RealSense, by its serial number ("": the only camera); options as of `open_camera`.

    The sensors are used directly, with one queue for both: images arrive as soon as they are taken, no filter of the
    SDK changes them, and each depth image gets the colour image nearest in time, at most half a period away, or none.
    The default is 640 x 480 at 30, or the nearest that there is; colour is streamed in the size and rate nearest to
    depth.
    """

    _first: bool  # no image has arrived yet

    def __init__(
        self,
        serial: str = "",
        *,
        width: int | None = None,
        height: int | None = None,
        fps: int | None = None,
        preset: str | None = None,
        align: bool = False,
        color: bool = True,
        global_time: bool = True,
    ) -> None:
        self._rs = need("pyrealsense2", "realsense")
        self._wanted = (width, height, fps)
        self._preset, self._align, self._color, self._global_time = preset, align, color, global_time
        self._sensors: list[Any] = []
        self._colorless = 0
        self._open(choose(self._rs, connected(self._rs), serial))

    def read(self) -> Frame | None:
        wait_s = FIRST_S if self._first else SILENT_S
        end = time.monotonic() + wait_s
        while (paired := self._pairing.pop()) is None:
            left = end - time.monotonic()
            come, image = self._queue.try_wait_for_frame(max(0, math.ceil(1000 * left)))
            if not come or left <= 0:
                raise CameraLost(f"no depth image for {wait_s:g} s; is the cable connected?")
            self._sort(image)
        self._first = False
        return self._frame(*paired)

    def reopen(self) -> None:
        self.close()
        rs = self._rs
        found = [d for d in connected(rs) if info(rs, d, "serial_number") == self._serial]
        if not found:
            raise CameraLost("not connected")
        try:
            self._open(found[0])
        except (OSError, RuntimeError) as error:  # it is there, but the system has not finished setting it up
            raise CameraLost(str(error)) from None

    def close(self) -> None:
        sensors, self._sensors = self._sensors, []
        for sensor in sensors:
            for release in (sensor.stop, sensor.close):
                try:
                    release()
                except RuntimeError:  # it was unplugged, or never started
                    continue

    def _open(self, device: Any) -> None:
        rs = self._rs
        self.name = describe(rs, device)
        self._serial = info(rs, device, "serial_number")
        sensor, depth = depth_profile(rs, device, *self._wanted)
        found = color_profile(device, depth) if self._color else None
        profiles = [depth, *([found[1]] if found else [])]
        self.camera = RGBDCamera.from_realsense(SimpleNamespace(get_streams=lambda: profiles))
        if self._preset is not None:
            set_preset(rs, sensor, self._preset)
        # The SDK has float32: its shortest decimal, 0.00025, is what the device means and what files say.
        self._scale = float(str(np.float32(sensor.get_option(rs.option.depth_units))))
        self._aligned = AlignedToDepth(rs) if self._align and found else None
        if self._aligned:
            self.camera = RGBDCamera(self.camera.depth)
        self._pairing = Pairing(1 / min(depth.fps(), found[1].fps() if found else depth.fps()))
        self._has_color = found is not None
        self._queue = rs.frame_queue(WAITING, keep_frames=True)
        self._first = True
        self._start([(sensor, depth), *([found] if found else [])])

    def _start(self, streams: list[tuple[Any, Any]]) -> None:
        """Start the streams; those of one sensor (a D405's depth and colour) have to be opened together."""
        by_sensor: dict[str, tuple[Any, list[Any]]] = {}
        for sensor, profile in streams:
            by_sensor.setdefault(str(sensor.name), (sensor, []))[1].append(profile)
        rs = self._rs
        try:
            for sensor, profiles in by_sensor.values():
                if sensor.supports(rs.option.global_time_enabled):
                    sensor.set_option(rs.option.global_time_enabled, float(self._global_time))
                sensor.open(profiles)
                self._sensors.append(sensor)
                sensor.start(self._queue)
        except RuntimeError as error:
            self.close()
            text = " ".join(str(error).split())
            used = any(word in text.lower() for word in ("busy", "errno=16", "in use", "streaming"))
            why = "another program uses it" if used else "it cannot be started"
            raise OSError(f"{self.name}: {why} ({text})") from None

    def _sort(self, image: Any) -> None:
        stamp_s = 1e-3 * image.get_timestamp()
        if image.is_depth_frame():
            self._pairing.add_depth(stamp_s, image)
            if not self._has_color:
                self._pairing.add_color(stamp_s, None)
        else:
            self._pairing.add_color(stamp_s, image)

    def _frame(self, stamp_s: float, depth: Any, color: Any) -> Frame:
        if color is not None and self._aligned is not None:
            color = self._aligned(depth, color)
        self._colorless = 0 if color is not None or not self._has_color else self._colorless + 1
        if self._colorless == COLORLESS:
            warnings.warn(
                f"{self.name}: {COLORLESS} depth images in a row without a colour image of the same time; "
                "frames have no colour. If its timestamps are on another clock, pass color=False",
                stacklevel=2,
            )
        pixels = np.asanyarray(depth.get_data())
        return Frame(pixels, _rgb(color), stamp_s, depth_scale=self._scale, check_units=False)


def _rgb(color: Any) -> NDArray[np.uint8] | None:
    """A copy, because the SDK uses its buffers again."""
    if color is None:
        return None
    pixels = np.asanyarray(color.get_data())
    bgr = str(color.get_profile().format()).endswith("bgr8")
    return np.array(pixels[..., ::-1] if bgr else pixels, dtype=np.uint8, order="C")


register_camera("realsense", "serial number, or nothing for the only one")(RealSense)

TIMEOUT_MS = 1000  # the block works on this thread: its result is there at once


class AlignedToDepth:
    """Applies ``rs.align`` to a depth and a colour frame of two sensors.

    The filter takes a frameset, which pipelines make; here a processing block makes one of the two frames.
    """

    def __init__(self, rs: Any) -> None:
        self._pair: list[Any] = []
        self._sets = rs.frame_queue(1)
        self._block = rs.processing_block(self._collect)
        self._block.start(self._sets)
        self._align = rs.align(rs.stream.depth)

    def __call__(self, depth: Any, color: Any) -> Any:
        """The colour frame, in the geometry of the depth frame."""
        for frame in (depth, color):
            self._block.invoke(frame)
        both = self._sets.wait_for_frame(TIMEOUT_MS).as_frameset()
        return self._align.process(both).get_color_frame()

    def _collect(self, frame: Any, source: Any) -> None:
        self._pair.append(frame)
        if len(self._pair) == 2:
            pair, self._pair = self._pair, []
            source.frame_ready(source.allocate_composite_frame(pair))


MAX_WAITING = 3  # depth images; later ones show that the colour images have stopped
KEPT = 8  # colour images


class Pairing:
    """Assigns to each depth image the colour image that is nearest in time, at most half a period away.

    Two streams of the same period: once a colour image is within half a period, no other one is nearer, so that
    nothing has to wait for the next one. A depth image whose colour image is missing is returned alone, as soon as a
    later colour image shows that it is.
    """

    def __init__(self, period_s: float) -> None:
        self._half_s = 0.5 * period_s
        self._depth: deque[tuple[float, Any]] = deque()
        self._color: deque[tuple[float, Any]] = deque(maxlen=KEPT)

    def add_depth(self, stamp_s: float, image: Any) -> None:
        """A depth image taken at `stamp_s` seconds has arrived."""
        self._depth.append((stamp_s, image))

    def add_color(self, stamp_s: float, image: Any) -> None:
        """A colour image taken at `stamp_s` seconds has arrived."""
        self._color.append((stamp_s, image))

    def pop(self) -> tuple[float, Any, Any] | None:
        """(timestamp, depth, colour or None) of the oldest depth image; None while its colour may still arrive."""
        if not self._depth:
            return None
        stamp, depth = self._depth[0]
        found = min(self._color, key=lambda color: abs(color[0] - stamp), default=None)
        if found is not None and abs(found[0] - stamp) <= self._half_s:
            self._depth.popleft()
            return stamp, depth, found[1]
        passed = any(color[0] > stamp + self._half_s for color in self._color)
        if passed or len(self._depth) > MAX_WAITING:
            self._depth.popleft()
            return stamp, depth, None
        return None
