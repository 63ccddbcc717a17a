# SPDX-License-Identifier: MIT
"""Recordings of the RealSense SDK and viewer: .db3 (rosbag2's schema), and the older .bag (ROS 1)."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import RGBDCamera
from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.datasets.bags.pictures import color_of, depth_of
from sdftrack.io.datasets.bags.rosbag1 import START, Rosbag1
from sdftrack.io.datasets.bags.sqlite_file import SqliteFile, topic_names
from sdftrack.io.datasets.bags.transforms import pose_of
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.io.datasets.streams import RealSenseStream, Stream, StreamFrames
from sdftrack.io.frames import decode_color, decode_depth_units

Streams = tuple[dict[str, RealSenseStream], float | None]
PREFIX = "/device_0/sensor_"
TEXT = "std_msgs/msg/String"
SEARCHED = 1 << 20  # bytes of the index, or of the file: the connections are at the beginning
COLORS = ("rgb8", "bgr8", "rgba8", "bgra8", "mono8")


def _detect(root: Path) -> bool:
    return root.is_file() and (_is_db3(root) or _is_bag(root))


@register("realsense", "a file .db3 or .bag with topics /device_0/sensor_0/", _detect)
def open_realsense(path: Path) -> Sequence:
    is_db3 = _is_db3(path)
    bag = Bag(path, [SqliteFile(path) if is_db3 else Rosbag1(path)])
    try:
        streams, depth_scale = _streams(bag, _db3_streams if is_db3 else _bag_streams)
        if "Depth" not in streams:
            found = ", ".join(streams) or "none"
            raise ValueError(
                f"{path}: the recording has no depth stream, which the trackers require; its streams: {found}"
            )
        depth, color = streams["Depth"], streams.get("Color")
        if depth_scale is None and bag.damage:
            raise ValueError(
                f"{path}: the recording cannot be read: its depth units are missing ({bag.damage})"
            )
        if depth_scale is None:
            warnings.warn(f"{path}: the depth units are not recorded; 1 mm is assumed", stacklevel=3)
            depth_scale = 0.001
        camera = RGBDCamera(depth.camera())
        if color is not None:
            T = color.T_stream_ref @ np.linalg.inv(depth.T_stream_ref)
            lens = color.camera()
            aligned = lens == camera.depth and np.allclose(T, np.eye(4), atol=1e-6)
            if not aligned:
                camera = RGBDCamera(camera.depth, lens, T_color_depth=T)
        if bag.damage:
            count = len(depth.stream.stamps_s)
            warnings.warn(f"{path}: {bag.damage}; what is whole is used: {count} depth images", stacklevel=3)
        frames = StreamFrames(path.name, depth.stream, color.stream if color else None, depth_scale)
        return Sequence(frames, camera, layout="realsense", name=path.stem, close=bag.close)
    except BaseException:
        bag.close()
        raise


def _streams(bag: Bag, read: Callable[[Bag], Streams]) -> Streams:
    try:
        return read(bag)
    except (ValueError, KeyError, IndexError, struct.error) as error:
        lacks = f" ({bag.damage})" if bag.damage else ""
        raise ValueError(f"{bag.path}: the recording cannot be read: {error}{lacks}") from None


def _is_db3(path: Path) -> bool:
    """Whether this is a database with RealSense's topics."""
    return any(name.startswith(PREFIX) for name in topic_names(path))


def _db3_streams(bag: Bag) -> tuple[dict[str, RealSenseStream], float | None]:
    """{"Depth": ..., "Color": ...} and metres per depth unit."""
    streams: dict[str, RealSenseStream] = {}
    for name in bag.topics:
        sensor_and_stream, found, _ = name.rpartition("/image/data/")
        if not found or not name.startswith(PREFIX):
            continue
        short = sensor_and_stream.rpartition("/")[2].partition("_")[0]  # "Depth_0"
        if short in ("Depth", "Color") and short not in streams:
            reader = _Db3Images(bag, sensor_and_stream, name)
            if short == "Depth" or reader.readable(bag.path):
                extrinsics = _db3_text(bag, f"{sensor_and_stream}/tf/")
                if bag.damage and not extrinsics:  # else the reference stream has none
                    raise ValueError(f"no pose in {sensor_and_stream}/tf")
                T = _db3_pose(extrinsics)
                streams[short] = RealSenseStream(reader.stream, _db3_lens(bag, sensor_and_stream), T)
    units = _db3_text(bag, PREFIX, "/option/Depth_Units/value")
    return streams, float(units) if units else None


class _Db3Images:
    """The compressed images of a topic and the timestamps of their metadata."""

    def __init__(self, bag: Bag, stream: str, topic: str) -> None:
        self._messages, self._depth = bag.messages(topic), stream.rpartition("/")[2].startswith("Depth")
        # Each image and its metadata are written with one time.
        known: dict[int, dict[str, str]] = {}
        if f"{stream}/image/metadata" in bag.topics:
            metadata = bag.messages(f"{stream}/image/metadata")
            for i, time in enumerate(metadata.recorded_ns()):
                known[int(time)] = _pairs(metadata[i].data)
        times = [int(time) for time in self._messages.recorded_ns()]
        stamps = np.array(
            [
                1e-3 * float(known[time]["timestamp"]) if "timestamp" in known.get(time, ()) else 1e-9 * time
                for time in times
            ]
        )
        self._order = np.argsort(stamps, kind="stable")
        self.stream = Stream(stamps[self._order], self._read)

    def readable(self, path: Path) -> bool:
        """Whether the colour images have a format that can be decoded; a warning if not."""
        if not len(self._order):
            return False
        kind = self._picture(0).encoding
        if "png" in kind or "jp" in kind:
            return True
        warnings.warn(
            f"{path}: colour images of format {kind!r} are ignored; record colour as RGB8", stacklevel=5
        )
        return False

    def _picture(self, i: int) -> Picture:
        return self._messages[int(self._order[i])]

    def _read(self, i: int) -> NDArray[Any]:
        picture = self._picture(i)
        kind, data = picture.encoding, bytes(picture.data)
        if not self._depth:
            return decode_color(data, "the colour image")
        if "png" not in kind:
            raise ValueError(f"a depth image of format {kind!r}, expected a PNG of 16 bits")
        return decode_depth_units(data[max(0, data.find(b"\x89PNG")) :], "the depth image")


def _db3_text(bag: Bag, prefix: str, suffix: str = "") -> str:
    """The first message, a string, of the first topic whose name begins and ends so; "" without one."""
    for name, topic in bag.topics.items():
        if name.startswith(prefix) and name.endswith(suffix) and topic.type == TEXT:
            return str(bag.messages(name)[0].data) if topic.count else ""
    return ""


def _pairs(text: str) -> dict[str, str]:
    """{"fps": "30", ...} of "encoding=Z16;fps=30"."""
    return {name: value for name, _, value in (part.partition("=") for part in text.split(";")) if name}


def _db3_lens(bag: Bag, stream: str) -> dict[str, Any]:
    values = _pairs(_db3_text(bag, f"{stream}/camera_info"))
    if not values:
        raise ValueError(f"no intrinsics in {stream}/camera_info")
    numbers: dict[str, Any] = {name: float(values[name]) for name in ("fx", "fy", "ppx", "ppy")}
    return {
        **numbers,
        "width": int(values["width"]),
        "height": int(values["height"]),
        "model": values["model"],
        "coeffs": [float(c) for c in values["coeffs"].split(",")],
    }


def _db3_pose(text: str) -> NDArray[np.float64]:
    """The SDK's extrinsics: rotation column by column, translation in metres, six digits each."""
    T = np.eye(4)
    values = _pairs(text)
    if values:
        T[:3, :3] = np.array(values["rotation"].split(","), dtype=float).reshape(3, 3).T
        T[:3, 3] = np.array(values["translation"].split(","), dtype=float)
    return T


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


def _bag_streams(bag: Bag) -> tuple[dict[str, RealSenseStream], float | None]:
    """{"Depth": ..., "Color": ...} and metres per depth unit."""
    streams: dict[str, RealSenseStream] = {}
    for topic in bag.topics:
        stream, found, _ = topic.rpartition("/image/data")
        short = stream.rpartition("/")[2].partition("_")[0]
        if found and topic.startswith(PREFIX) and short in ("Depth", "Color") and short not in streams:
            reader = _BagImages(bag, topic)
            if short == "Depth" or reader.readable(bag.path):
                poses = [name for name in bag.topics if name.startswith(f"{stream}/tf/")]
                if bag.damage and not poses:  # else the reference stream has none
                    raise ValueError(f"no pose in {stream}/tf")
                T = pose_of(bag.messages(poses[0])[0]) if poses else np.eye(4)
                if T is None:
                    raise ValueError(f"no pose in {poses[0]}")
                if f"{stream}/info/camera_info" not in bag.topics:
                    raise ValueError(f"no message in {stream}/info/camera_info")
                info = bag.messages(f"{stream}/info/camera_info")[0]
                streams[short] = RealSenseStream(reader.stream, _bag_lens(info.message), T)
    units = [name for name in bag.topics if name.endswith("/option/Depth Units/value")]
    if not units:
        return streams, None
    # The message is float32: its shortest decimal is what the device means.
    return streams, float(str(np.float32(bag.messages(units[0])[0].data)))


class _BagImages:
    """The images of a topic; their timestamps are in their headers, so the file is read once to begin with."""

    def __init__(self, bag: Bag, topic: str) -> None:
        self._messages, self._depth = bag.messages(topic), "/Depth_" in topic
        times = [divmod(self._messages.stamp_ns(i), 10**9) for i in range(len(self._messages))]
        stamps = np.array([seconds + 1e-9 * nanoseconds for seconds, nanoseconds in times])
        self._order = np.argsort(stamps, kind="stable")
        self.stream = Stream(stamps[self._order], self._read)

    def readable(self, path: Path) -> bool:
        """Whether the colour images have a format that can be decoded; a warning if not."""
        encoding = self._picture(0).encoding
        if encoding in COLORS:
            return True
        warnings.warn(
            f"{path}: colour images of format {encoding!r} are ignored; record colour as RGB8", stacklevel=5
        )
        return False

    def _picture(self, i: int) -> Picture:
        return self._messages[int(self._order[i])]

    def _read(self, i: int) -> NDArray[Any]:
        picture = self._picture(i)
        if not self._depth:
            return color_of(picture, "the colour image")
        if picture.encoding not in ("mono16", "16UC1"):
            raise ValueError(f"a depth image of encoding {picture.encoding!r}, expected mono16")
        return depth_of(picture, "the depth image")[0]


def _bag_lens(message: Any) -> dict[str, Any]:
    K = np.asarray(message.K if hasattr(message, "K") else message.k).reshape(3, 3)
    D = np.asarray(message.D if hasattr(message, "D") else message.d)
    return {
        "fx": K[0, 0], "fy": K[1, 1], "ppx": K[0, 2], "ppy": K[1, 2],
        "width": int(message.width), "height": int(message.height),
        "model": message.distortion_model, "coeffs": D.tolist(),
    }  # fmt: skip
