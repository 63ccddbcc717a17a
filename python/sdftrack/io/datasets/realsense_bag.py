# SPDX-License-Identifier: MIT
"""RealSense's .bag: a ROS 1 bag with raw images, read by `rosbags`; needs neither ROS nor the SDK."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack._internal.quaternions import rotation
from sdftrack.io.datasets.realsense_stream import RealSenseStream
from sdftrack.io.datasets.streams import Stream

__all__ = ["color_pixels", "detect", "read_streams"]

MAGIC = b"#ROSBAG V2.0\n"
MARK = b"/device_0/sensor_"
SEARCHED = 1 << 20  # bytes of the index: the connections are at its beginning
CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}


def detect(path: Path) -> bool:
    """Whether this is a ROS 1 bag with RealSense's topics, which the index lists."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            return False
        header = file.read(4096)
        at = header.find(b"index_pos=")
        if at < 0 or len(header) < at + 18:
            return False
        (index,) = struct.unpack_from("<Q", header, at + 10)
        file.seek(index or len(MAGIC))
        return MARK in file.read(SEARCHED)


def read_streams(path: Path) -> tuple[dict[str, RealSenseStream], float | None, Callable[[], None]]:
    """{"Depth": ..., "Color": ...}, metres per depth unit, and the function that closes the file."""
    need("rosbags", "bags")
    from rosbags.rosbag1 import Reader, ReaderError
    from rosbags.typesys import Stores, get_typestore

    bag, store = Reader(path), get_typestore(Stores.ROS1_NOETIC)
    try:
        bag.open()
    except ReaderError as error:
        raise ValueError(f"{path}: the recording cannot be read: {error}") from None
    try:
        topics = {connection.topic: connection for connection in bag.connections}

        def first(topic: str) -> Any:
            for _, _, data in bag.messages([topics[topic]]):
                return store.deserialize_ros1(data, topics[topic].msgtype)
            raise ValueError(f"no message in {topic}")

        streams: dict[str, RealSenseStream] = {}
        for topic in topics:
            stream, found, _ = topic.rpartition("/image/data")
            short = stream.rpartition("/")[2].partition("_")[0]
            if (
                found
                and topic.startswith(MARK.decode())
                and short in ("Depth", "Color")
                and short not in streams
            ):
                reader = _Images(bag, topics[topic], store)
                if short == "Depth" or reader.readable(path):
                    poses = [name for name in topics if name.startswith(f"{stream}/tf/")]
                    T = _pose(first(poses[0])) if poses else np.eye(4)
                    lens = _lens(first(f"{stream}/info/camera_info"))
                    streams[short] = RealSenseStream(reader.stream, lens, T)
        units = [name for name in topics if name.endswith("/option/Depth Units/value")]
        # The message is float32: its shortest decimal is what the device means.
        scale = float(str(np.float32(first(units[0]).data))) if units else None
        return streams, scale, bag.close
    except (ReaderError, ValueError, KeyError) as error:
        bag.close()
        raise ValueError(f"{path}: the recording cannot be read: {error}") from None


class _Images:
    """The images of a topic; their timestamps are in their headers, so the file is read once to begin with."""

    def __init__(self, bag: Any, connection: Any, store: Any) -> None:
        self._bag, self._connection, self._store = bag, connection, store
        self._depth = "/Depth_" in connection.topic
        found: list[
            tuple[float, int, int]
        ] = []  # timestamp, time in the bag, number among those of that time
        last, rank = -1, 0
        for _, time, data in bag.messages([connection]):
            rank = rank + 1 if time == last else 0
            last = time
            seconds, nanoseconds = struct.unpack_from("<II", data, 4)  # of the header, behind its counter
            found.append((seconds + 1e-9 * nanoseconds, time, rank))
        found.sort(key=lambda entry: entry[0])
        self._places = [(time, rank) for _, time, rank in found]
        self.stream = Stream(np.array([stamp for stamp, _, _ in found]), self._read)

    def readable(self, path: Path) -> bool:
        """Whether the colour images have a format that can be decoded; a warning if not."""
        if not self._places:
            return False
        encoding = self._message(0).encoding
        if encoding in CHANNELS:
            return True
        warnings.warn(
            f"{path}: colour images of format {encoding!r} are ignored; record colour as RGB8", stacklevel=5
        )
        return False

    def _message(self, i: int) -> Any:
        time, rank = self._places[i]
        messages = list(self._bag.messages([self._connection], start=time, stop=time + 1))
        return self._store.deserialize_ros1(messages[rank][2], self._connection.msgtype)

    def _read(self, i: int) -> NDArray[Any]:
        image = self._message(i)
        if self._depth:
            if image.encoding not in ("mono16", "16UC1"):
                raise ValueError(f"a depth image of encoding {image.encoding!r}, expected mono16")
            rows = image.data.view(">u2" if image.is_bigendian else "<u2").reshape(
                image.height, image.step // 2
            )
            return np.ascontiguousarray(rows[:, : image.width], np.uint16)
        return color_pixels(image)


def color_pixels(image: Any) -> NDArray[np.uint8]:
    """(H, W, 3) uint8 RGB of a message with one of `CHANNELS`."""
    channels = CHANNELS[image.encoding]
    rows = image.data.reshape(image.height, image.step)[:, : image.width * channels]
    pixels = rows.reshape(image.height, image.width, channels)
    if channels == 1:
        return np.ascontiguousarray(np.repeat(pixels, 3, axis=2))
    return np.ascontiguousarray(pixels[..., 2::-1] if image.encoding.startswith("bgr") else pixels[..., :3])


def _lens(message: Any) -> dict[str, Any]:
    K = np.asarray(message.K if hasattr(message, "K") else message.k).reshape(3, 3)
    D = np.asarray(message.D if hasattr(message, "D") else message.d)
    return {
        "fx": K[0, 0], "fy": K[1, 1], "ppx": K[0, 2], "ppy": K[1, 2],
        "width": int(message.width), "height": int(message.height),
        "model": message.distortion_model, "coeffs": D.tolist(),
    }  # fmt: skip


def _pose(message: Any) -> NDArray[np.float64]:
    q, t = message.rotation, message.translation
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation([q.x, q.y, q.z, q.w]), [t.x, t.y, t.z]
    return T
