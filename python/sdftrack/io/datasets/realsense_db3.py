# SPDX-License-Identifier: MIT
"""RealSense's .db3: topics of a ROS 2 bag with compressed images and texts; needs neither ROS nor the SDK."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.datasets.bags.sqlite_file import topic_names
from sdftrack.io.datasets.realsense_stream import RealSenseStream
from sdftrack.io.datasets.streams import Stream
from sdftrack.io.frames import decode_color, decode_depth_units

__all__ = ["detect", "read_streams"]

PREFIX = "/device_0/sensor_"
TEXT = "std_msgs/msg/String"


def detect(path: Path) -> bool:
    """Whether this is a database with RealSense's topics."""
    return any(name.startswith(PREFIX) for name in topic_names(path))


def read_streams(bag: Bag) -> tuple[dict[str, RealSenseStream], float | None]:
    """{"Depth": ..., "Color": ...} and metres per depth unit."""
    streams: dict[str, RealSenseStream] = {}
    for name in bag.topics:
        sensor_and_stream, found, _ = name.rpartition("/image/data/")
        if not found or not name.startswith(PREFIX):
            continue
        short = sensor_and_stream.rpartition("/")[2].partition("_")[0]  # "Depth_0"
        if short in ("Depth", "Color") and short not in streams:
            reader = _Images(bag, sensor_and_stream, name)
            if short == "Depth" or reader.readable(bag.path):
                extrinsics = _text(bag, f"{sensor_and_stream}/tf/")
                if bag.damage and not extrinsics:  # else the reference stream has none
                    raise ValueError(f"no pose in {sensor_and_stream}/tf")
                T = _pose(extrinsics)
                streams[short] = RealSenseStream(reader.stream, _lens(bag, sensor_and_stream), T)
    units = _text(bag, PREFIX, "/option/Depth_Units/value")
    return streams, float(units) if units else None


class _Images:
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
        picture: Picture = self._messages[int(self._order[i])]
        return picture

    def _read(self, i: int) -> NDArray[Any]:
        picture = self._picture(i)
        kind, data = picture.encoding, bytes(picture.data)
        if not self._depth:
            return decode_color(data, "the colour image")
        if "png" not in kind:
            raise ValueError(f"a depth image of format {kind!r}, expected a PNG of 16 bits")
        return decode_depth_units(data[max(0, data.find(b"\x89PNG")) :], "the depth image")


def _text(bag: Bag, prefix: str, suffix: str = "") -> str:
    """The first message, a string, of the first topic whose name begins and ends so; "" without one."""
    for name, topic in bag.topics.items():
        if name.startswith(prefix) and name.endswith(suffix) and topic.type == TEXT:
            return str(bag.messages(name)[0].data) if topic.count else ""
    return ""


def _pairs(text: str) -> dict[str, str]:
    """{"fps": "30", ...} of "encoding=Z16;fps=30"."""
    return {name: value for name, _, value in (part.partition("=") for part in text.split(";")) if name}


def _lens(bag: Bag, stream: str) -> dict[str, Any]:
    values = _pairs(_text(bag, f"{stream}/camera_info"))
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


def _pose(text: str) -> NDArray[np.float64]:
    """The SDK's extrinsics: rotation column by column, translation in metres, six digits each."""
    T = np.eye(4)
    values = _pairs(text)
    if values:
        T[:3, :3] = np.array(values["rotation"].split(","), dtype=float).reshape(3, 3).T
        T[:3, 3] = np.array(values["translation"].split(","), dtype=float)
    return T
