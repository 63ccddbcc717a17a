# SPDX-License-Identifier: MIT
"""RealSense devices: which are connected, their streams, their options."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

PREFERRED = (640, 480, 30)  # where the user leaves it open; every D400 has it
COLOR_FORMATS = ("rgb8", "bgr8")


def connected(rs: Any) -> list[Any]:
    """The devices that are connected now."""
    return list(rs.context().query_devices())


def info(rs: Any, device: Any, name: str) -> str:
    """A text that describes the device, "" if it does not have it."""
    what = getattr(rs.camera_info, name)
    return str(device.get_info(what)) if device.supports(what) else ""


def choose(rs: Any, devices: list[Any], serial: str) -> Any:
    """The device with this serial number, or the only one.

    OSError if none is connected, or none with this number; ValueError if several are and no number is given. Both list
    those that are there.
    """
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
    """Name and serial number, for messages."""
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
    """Choose a visual preset by its name; ValueError lists those that the camera has."""
    option = rs.option.visual_preset
    known: dict[str, float] = {}
    if sensor.supports(option):
        span = sensor.get_option_range(option)
        for value in range(int(span.min), int(span.max) + 1):
            text = sensor.get_option_value_description(option, value)
            if text:
                known[text] = value
    by_name = {_plain(name): value for name, value in known.items()}
    if _plain(preset) not in by_name:
        raise ValueError(
            f"preset: expected one of {', '.join(known) or 'none, for this camera'}, got {preset!r}"
        )
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
    def fits(profile: Any) -> bool:
        has = (profile.width(), profile.height(), profile.fps())
        return all(w is None or w == h for w, h in zip(wanted, has, strict=True))

    fitting = [profile for profile in profiles if fits(profile)]
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
    given = ", ".join(
        f"{name}={value}"
        for name, value in zip(("width", "height", "fps"), wanted, strict=True)
        if value is not None
    )
    raise ValueError(
        f"width, height, fps: {describe(rs, device)} has depth of {listed} frames per second"
        + (f" at USB {usb}" if usb else "")
        + f", got {given}"
    )
