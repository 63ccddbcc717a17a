# SPDX-License-Identifier: MIT
"""RealSense's .bag: topics of a ROS 1 bag with raw images; needs neither ROS nor the SDK."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.datasets.bags.pictures import color_of, depth_of
from sdftrack.io.datasets.bags.rosbag1 import START
from sdftrack.io.datasets.bags.transforms import pose_of
from sdftrack.io.datasets.realsense_stream import RealSenseStream
from sdftrack.io.datasets.streams import Stream

__all__ = ["detect", "read_streams"]

PREFIX = "/device_0/sensor_"
SEARCHED = 1 << 20  # bytes of the index, or of the file: the connections are at the beginning
COLORS = ("rgb8", "bgr8", "rgba8", "bgra8", "mono8")


def detect(path: Path) -> bool:
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


def read_streams(bag: Bag) -> tuple[dict[str, RealSenseStream], float | None]:
    """{"Depth": ..., "Color": ...} and metres per depth unit."""
    streams: dict[str, RealSenseStream] = {}
    for topic in bag.topics:
        stream, found, _ = topic.rpartition("/image/data")
        short = stream.rpartition("/")[2].partition("_")[0]
        if found and topic.startswith(PREFIX) and short in ("Depth", "Color") and short not in streams:
            reader = _Images(bag, topic)
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
                streams[short] = RealSenseStream(reader.stream, _lens(info.message), T)
    units = [name for name in bag.topics if name.endswith("/option/Depth Units/value")]
    if not units:
        return streams, None
    # The message is float32: its shortest decimal is what the device means.
    return streams, float(str(np.float32(bag.messages(units[0])[0].data)))


class _Images:
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
        picture: Picture = self._messages[int(self._order[i])]
        return picture

    def _read(self, i: int) -> NDArray[Any]:
        picture = self._picture(i)
        if not self._depth:
            return color_of(picture, "the colour image")
        if picture.encoding not in ("mono16", "16UC1"):
            raise ValueError(f"a depth image of encoding {picture.encoding!r}, expected mono16")
        return depth_of(picture, "the depth image")[0]


def _lens(message: Any) -> dict[str, Any]:
    K = np.asarray(message.K if hasattr(message, "K") else message.k).reshape(3, 3)
    D = np.asarray(message.D if hasattr(message, "D") else message.d)
    return {
        "fx": K[0, 0], "fy": K[1, 1], "ppx": K[0, 2], "ppy": K[1, 2],
        "width": int(message.width), "height": int(message.height),
        "model": message.distortion_model, "coeffs": D.tolist(),
    }  # fmt: skip
