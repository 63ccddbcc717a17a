# SPDX-License-Identifier: MIT
"""A RealSense camera: raw depth and colour of its sensors, paired by their timestamps; devices, streams, options."""

from __future__ import annotations

import math
import time
import warnings
from collections import deque
from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack.camera import RGBDCamera
from sdftrack.frame import Frame
from sdftrack.live.camera import CameraLost, register_camera

FIRST_S = 5.0  # a camera delivers its first image within so long: D400 take up to 2 s
SILENT_S = 1.0  # and every other one
WAITING = 16  # images of both sensors in the queue, several periods
COLORLESS = 30  # frames without colour in a row


class RealSense:
    """A running RealSense, by its serial number ("": the only camera); options as of `open_camera`. The sensors are
    used directly, with one queue for both: images arrive as soon as they are taken, no filter of the SDK changes them,
    and each depth image gets the colour image nearest in time, at most half a period away, or none. The default is 640
    x 480 at 30, or the nearest that there is; colour is streamed in the size and rate nearest to depth."""

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
            stamp_s = 1e-3 * image.get_timestamp()
            (self._pairing.depth if image.is_depth_frame() else self._pairing.color).append((stamp_s, image))
            if image.is_depth_frame() and not self._has_color:
                self._pairing.color.append((stamp_s, None))
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
    """Applies ``rs.align`` to a depth and a colour frame of two sensors. The filter takes a frameset, which pipelines
    make; here a processing block makes one of the two frames."""

    def __init__(self, rs: Any) -> None:
        self._pair: list[Any] = []
        self._sets = rs.frame_queue(1)
        self._block = rs.processing_block(self._collect)
        self._block.start(self._sets)
        self._align = rs.align(rs.stream.depth)

    def __call__(self, depth: Any, color: Any) -> Any:
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
    """Assigns to each depth image the colour image that is nearest in time, at most half a period away; `depth` and
    `color` are (timestamp, image) that have arrived. Two streams of the same period: once a colour image is within half
    a period, no other one is nearer, so that nothing has to wait for the next one. A depth image whose colour image is
    missing is returned alone, as soon as a later colour image shows that it is."""

    def __init__(self, period_s: float) -> None:
        self._half_s = 0.5 * period_s
        self.depth: deque[tuple[float, Any]] = deque()
        self.color: deque[tuple[float, Any]] = deque(maxlen=KEPT)

    def pop(self) -> tuple[float, Any, Any] | None:
        """(timestamp, depth, colour or None) of the oldest depth image; None while its colour may still arrive."""
        if not self.depth:
            return None
        stamp, depth = self.depth[0]
        found = min(self.color, key=lambda color: abs(color[0] - stamp), default=(math.inf, None))
        near = abs(found[0] - stamp) <= self._half_s
        passed = any(color[0] > stamp + self._half_s for color in self.color)
        if not near and not passed and len(self.depth) <= MAX_WAITING:
            return None
        self.depth.popleft()
        return stamp, depth, found[1] if near else None


PREFERRED = (640, 480, 30)  # where the user leaves it open; every D400 has it
COLOR_FORMATS = ("rgb8", "bgr8")


def connected(rs: Any) -> list[Any]:
    return list(rs.context().query_devices())


def info(rs: Any, device: Any, name: str) -> str:
    what = getattr(rs.camera_info, name)
    return str(device.get_info(what)) if device.supports(what) else ""


def choose(rs: Any, devices: list[Any], serial: str) -> Any:
    """The device with this serial number, or the only one. OSError if none is connected, or none with this number;
    ValueError if several are and no number is given. Both list those that are there."""
    serials = [info(rs, device, "serial_number") for device in devices]
    names = ", ".join(describe(rs, device) for device in devices)
    if not devices:
        raise OSError("realsense: no camera is connected; check the cable and, on Linux, the udev rules")
    if serial and serial not in serials:
        raise OSError(f"realsense:{serial}: no camera has this serial number; connected are: {names}")
    if not serial and len(devices) > 1:
        raise ValueError(
            f"realsense: {len(devices)} cameras are connected: {names}; choose one by its serial number, "
            f"as in realsense:{serials[0]}"
        )
    return devices[serials.index(serial) if serial else 0]


def describe(rs: Any, device: Any) -> str:
    name = info(rs, device, "name").removeprefix("Intel ").removeprefix("RealSense ")
    return f"RealSense {name} (serial {info(rs, device, 'serial_number')})"


def depth_profile(rs: Any, device: Any, width: int | None, height: int | None, fps: int | None) -> Any:
    """(sensor, profile) of the depth stream; ValueError, with a list, if there is none in this size and rate."""
    for sensor in device.query_sensors():
        profiles = _video(sensor, "depth", ("z16",))
        if profiles:
            return sensor, _best(rs, device, profiles, (width, height, fps))
    raise ValueError(f"{describe(rs, device)}: the camera has no depth stream, which the trackers require")


def color_profile(device: Any, depth: Any) -> Any:
    """(sensor, profile) of the colour stream nearest to the depth stream in rate and size; None without one."""
    wanted = (depth.width(), depth.height(), depth.fps())
    for sensor in device.query_sensors():
        profiles = _video(sensor, "color", COLOR_FORMATS)
        if profiles:
            return sensor, min(
                profiles, key=lambda p: (*_distance(p, wanted), COLOR_FORMATS.index(_word(p.format())))
            )
    return None


def set_preset(rs: Any, sensor: Any, preset: str) -> None:
    option, known = rs.option.visual_preset, dict[str, float]()
    if sensor.supports(option):
        span = sensor.get_option_range(option)
        for value in range(int(span.min), int(span.max) + 1):
            if text := sensor.get_option_value_description(option, value):
                known[text] = value
    by_name = {_plain(name): value for name, value in known.items()}
    if _plain(preset) not in by_name:
        expected = ", ".join(known) or "none, for this camera"
        raise ValueError(f"preset: expected one of {expected}, got {preset!r}")
    sensor.set_option(option, by_name[_plain(preset)])


def _plain(name: str) -> str:
    return name.lower().replace(" ", "").replace("_", "").replace("-", "")


def _video(sensor: Any, kind: str, formats: Iterable[str]) -> list[Any]:
    found = []
    for profile in sensor.get_stream_profiles():
        if not profile.is_video_stream_profile():
            continue
        stream, pixel = (_word(value) for value in (profile.stream_type(), profile.format()))
        if stream == kind and pixel in formats:
            found.append(profile.as_video_stream_profile())
    return found


def _word(value: Any) -> str:
    return str(value).rsplit(".", 1)[-1]


def _distance(profile: Any, wanted: tuple[int, int, int]) -> tuple[int, int, int]:
    width, height, fps = wanted
    pixels = profile.width() * profile.height()
    return abs(profile.fps() - fps), abs(pixels - width * height), abs(profile.width() - width)


def _best(
    rs: Any, device: Any, profiles: list[Any], wanted: tuple[int | None, int | None, int | None]
) -> Any:
    fitting = [
        p
        for p in profiles
        if all(w in (None, has) for w, has in zip(wanted, (p.width(), p.height(), p.fps()), strict=True))
    ]
    if fitting:
        width, height, fps = (
            w if w is not None else preferred for w, preferred in zip(wanted, PREFERRED, strict=True)
        )
        return min(fitting, key=lambda profile: _distance(profile, (width, height, fps)))
    rates: dict[tuple[int, int], set[int]] = {}
    for profile in profiles:
        rates.setdefault((profile.width(), profile.height()), set()).add(profile.fps())
    listed = "; ".join(f"{w} x {h} at {', '.join(map(str, sorted(rates[w, h])))}" for w, h in sorted(rates))
    usb = info(rs, device, "usb_type_descriptor")
    named = zip(("width", "height", "fps"), wanted, strict=True)
    given = ", ".join(f"{name}={value}" for name, value in named if value is not None)
    has = f"has depth of {listed} frames per second{usb and ' at USB ' + usb}"
    raise ValueError(f"width, height, fps: {describe(rs, device)} {has}, got {given}")
