# SPDX-License-Identifier: MIT
"""Recordings of the RealSense SDK and viewer: .db3 (rosbag2's schema), and the older .bag (ROS 1)."""

from __future__ import annotations

import re
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import closed_on_error
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.io.datasets.bags.bag import Bag, Messages
from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.datasets.bags.pictures import color_of, depth_of
from sdftrack.io.datasets.bags.rosbag1 import START, Rosbag1
from sdftrack.io.datasets.bags.sqlite_file import SqliteFile, topic_names
from sdftrack.io.datasets.bags.topics import pose_of
from sdftrack.io.datasets.pairing import Stream, StreamFrames
from sdftrack.io.datasets.sequence import Sequence, register
from sdftrack.io.frames import decode_depth_units

Array = NDArray[np.float64]
PREFIX = "/device_0/sensor_"
TEXT = "std_msgs/msg/String"
SEARCHED = 1 << 20  # bytes of the index, or of the file: the connections are at the beginning
COLORS = ("rgb8", "bgr8", "rgba8", "bgra8", "mono8")


def _detect(root: Path) -> bool:
    return root.is_file() and (_is_db3(root) or _is_bag(root))


def _is_db3(path: Path) -> bool:
    return any(name.startswith(PREFIX) for name in topic_names(path))


@register("realsense", "a file .db3 or .bag with topics /device_0/sensor_0/", _detect)
def open_realsense(path: Path) -> Sequence:
    is_db3 = _is_db3(path)
    bag = Bag(path, [SqliteFile(path) if is_db3 else Rosbag1(path)])
    about = _Database(bag) if is_db3 else _Ros1(bag)
    with closed_on_error(bag):
        unreadable = f"{path}: the recording cannot be read"
        try:
            sensors, depth_scale = _sensors(bag, about), about.depth_scale()
        except (ValueError, KeyError, IndexError, struct.error) as error:
            lacks = f" ({bag.damage})" if bag.damage else ""
            raise ValueError(f"{unreadable}: {error}{lacks}") from None
        if "Depth" not in sensors:
            streams = f"its streams: {', '.join(sensors) or 'none'}"
            raise ValueError(
                f"{path}: the recording has no depth stream, which the trackers require; {streams}"
            )
        depth, color = sensors["Depth"], sensors.get("Color")
        if depth_scale is None and bag.damage:
            raise ValueError(f"{unreadable}: its depth units are missing ({bag.damage})")
        if depth_scale is None:
            warnings.warn(f"{path}: the depth units are not recorded; 1 mm is assumed", stacklevel=3)
            depth_scale = 0.001
        camera = RGBDCamera(depth.camera)
        if color is not None:
            T = color.T_stream_ref @ np.linalg.inv(depth.T_stream_ref)
            if color.camera != depth.camera or not np.allclose(T, np.eye(4), atol=1e-6):
                camera = RGBDCamera(depth.camera, color.camera, T_color_depth=T)
        if bag.damage:
            count = len(depth.stream.stamps_s)
            warnings.warn(f"{path}: {bag.damage}; what is whole is used: {count} depth images", stacklevel=3)
        frames = StreamFrames(path.name, depth.stream, color.stream if color else None, depth_scale)
        return Sequence(frames, camera, layout="realsense", name=path.stem, close=bag.close)


def _is_bag(path: Path) -> bool:
    """Whether this is a ROS 1 bag with RealSense's topics: by its index, or where that is missing by its beginning."""
    with path.open("rb") as file:
        if file.read(len(START)) != START:
            return False
        header = file.read(4096)
        at = header.find(b"index_pos=")
        if at < 0 or len(header) < at + 18:
            return False
        (index,) = struct.unpack_from("<Q", header, at + 10)
        # Beyond the file's end where it is cut.
        file.seek(index if 0 < index < path.stat().st_size else 0)
        return PREFIX.encode() in file.read(SEARCHED)


def _pairs(text: str) -> dict[str, str]:
    return {name: value for name, _, value in (part.partition("=") for part in text.split(";")) if name}


class _Database:
    """What a .db3 says about a stream: texts on topics beside it."""

    def __init__(self, bag: Bag) -> None:
        self._bag = bag

    def stamps_s(self, stream: str, images: Messages) -> Array:
        """By the metadata: each image and its own are written with one time."""
        known: dict[int, dict[str, str]] = {}
        if f"{stream}/image/metadata" in self._bag.topics:
            metadata = self._bag.messages(f"{stream}/image/metadata")
            known = {int(time): _pairs(metadata[i].data) for i, time in enumerate(metadata.recorded_ns())}
        return np.array(
            [
                1e-3 * float(known[time]["timestamp"]) if "timestamp" in known.get(time, ()) else 1e-9 * time
                for time in map(int, images.recorded_ns())
            ]
        )

    def pose(self, stream: str) -> Array | None:
        values = _pairs(self._text(f"{stream}/tf/"))
        if not values:
            return None
        T = np.eye(4)
        T[:3, :3] = np.array(values["rotation"].split(","), dtype=float).reshape(3, 3).T
        T[:3, 3] = np.array(values["translation"].split(","), dtype=float)
        return T

    def lens(self, stream: str) -> dict[str, Any]:
        values = _pairs(self._text(f"{stream}/camera_info"))
        if not values:
            raise ValueError(f"no intrinsics in {stream}/camera_info")
        return {
            **{name: float(values[name]) for name in ("fx", "fy", "ppx", "ppy")},
            "width": int(values["width"]), "height": int(values["height"]),
            "model": values["model"], "coeffs": [float(c) for c in values["coeffs"].split(",")],
        }  # fmt: skip

    def depth_scale(self) -> float | None:
        units = self._text(PREFIX, "/option/Depth_Units/value")
        return float(units) if units else None

    def _text(self, prefix: str, suffix: str = "") -> str:
        """The first message, a string, of the first topic whose name begins and ends so; "" without one."""
        for name, topic in self._bag.topics.items():
            if name.startswith(prefix) and name.endswith(suffix) and topic.type == TEXT:
                return str(self._bag.messages(name)[0].data) if topic.count else ""
        return ""


class _Ros1:
    """What a .bag says about a stream: messages of ROS beside it."""

    def __init__(self, bag: Bag) -> None:
        self._bag = bag

    def stamps_s(self, stream: str, images: Messages) -> Array:
        """By the headers of the images, so the file is read once to begin with."""
        times = [divmod(images.stamp_ns(i), 10**9) for i in range(len(images))]
        return np.array([seconds + 1e-9 * nanoseconds for seconds, nanoseconds in times])

    def pose(self, stream: str) -> Array | None:
        for name in self._bag.topics:
            if name.startswith(f"{stream}/tf/"):
                T = pose_of(self._bag.messages(name)[0])
                if T is None:
                    raise ValueError(f"no pose in {name}")
                return T
        return None

    def lens(self, stream: str) -> dict[str, Any]:
        if f"{stream}/info/camera_info" not in self._bag.topics:
            raise ValueError(f"no message in {stream}/info/camera_info")
        message = self._bag.messages(f"{stream}/info/camera_info")[0].message
        K = np.asarray(message.K if hasattr(message, "K") else message.k).reshape(3, 3)
        D = np.asarray(message.D if hasattr(message, "D") else message.d)
        return {
            "fx": K[0, 0], "fy": K[1, 1], "ppx": K[0, 2], "ppy": K[1, 2],
            "width": int(message.width), "height": int(message.height),
            "model": message.distortion_model, "coeffs": D.tolist(),
        }  # fmt: skip

    def depth_scale(self) -> float | None:
        for name in self._bag.topics:
            if name.endswith("/option/Depth Units/value"):
                # The message is float32: its shortest decimal is what the device means.
                return float(str(np.float32(self._bag.messages(name)[0].data)))
        return None


class _Sensor(NamedTuple):
    """A stream of images; `T_stream_ref` maps points of the recording's reference stream to this one, m."""

    stream: Stream
    camera: Camera
    T_stream_ref: Array


def _sensors(bag: Bag, about: _Database | _Ros1) -> dict[str, _Sensor]:
    sensors: dict[str, _Sensor] = {}
    for topic in bag.topics:
        stream, found, _ = topic.rpartition("/image/data")
        kind = stream.rpartition("/")[2].partition("_")[0]  # of "Depth_0"
        if not found or not topic.startswith(PREFIX) or kind not in READERS or kind in sensors:
            continue
        images = bag.messages(topic)
        stamps = about.stamps_s(stream, images)
        order = np.argsort(stamps, kind="stable")
        if kind == "Color" and not (len(order) and _is_known(bag.path, images[int(order[0])])):
            continue
        T = about.pose(stream)
        if bag.damage and T is None:  # else the reference stream has none
            raise ValueError(f"no pose in {stream}/tf")

        def read(i: int, kind: str = kind, images: Messages = images, order: Any = order) -> NDArray[Any]:
            return READERS[kind](images[int(order[i])])

        camera = Camera.from_realsense(SimpleNamespace(**about.lens(stream)))
        sensors[kind] = _Sensor(Stream(stamps[order], read), camera, np.eye(4) if T is None else T)
    return sensors


def _is_known(path: Path, picture: Picture) -> bool:
    if picture.encoding in COLORS if picture.width else re.search("png|jp", picture.encoding):
        return True
    warnings.warn(
        f"{path}: colour images of format {picture.encoding!r} are ignored; record colour as RGB8",
        stacklevel=5,
    )
    return False


def _depth(picture: Picture) -> NDArray[Any]:
    if picture.width:
        if picture.encoding not in ("mono16", "16UC1"):
            raise ValueError(f"a depth image of encoding {picture.encoding!r}, expected mono16")
        return depth_of(picture, "the depth image")[0]
    if "png" not in picture.encoding:
        raise ValueError(f"a depth image of format {picture.encoding!r}, expected a PNG of 16 bits")
    data = bytes(picture.data)
    return decode_depth_units(data[max(0, data.find(b"\x89PNG")) :], "the depth image")


def _color(picture: Picture) -> NDArray[Any]:
    return color_of(picture, "the colour image")


READERS: dict[str, Callable[[Picture], NDArray[Any]]] = {
    "Depth": _depth,
    "Color": lambda picture: color_of(picture, "the colour image"),
}
