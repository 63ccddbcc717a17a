# SPDX-License-Identifier: MIT
"""Messages of ROS 1, ROS 2 and Foxglove (protobuf, JSON) as the same few classes."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from sdftrack._internal.extras import need
from sdftrack._internal.text_files import reason_of

if TYPE_CHECKING:
    from sdftrack.io.datasets.bags.bag import Channel

ROS_IMAGE, ROS_COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
FOX_IMAGE, FOX_COMPRESSED = "foxglove.RawImage", "foxglove.CompressedImage"
IMAGE_TYPES = (ROS_IMAGE, ROS_COMPRESSED, FOX_IMAGE, FOX_COMPRESSED)
INFO_TYPES = ("sensor_msgs/msg/CameraInfo", "foxglove.CameraCalibration")
TRANSFORM_TYPES = (
    "tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "foxglove.FrameTransform", "foxglove.FrameTransforms",
)  # fmt: skip
ROS_TRANSFORM = "geometry_msgs/msg/Transform"
WITH_HEADER = (ROS_IMAGE, ROS_COMPRESSED, INFO_TYPES[0])


@dataclass(frozen=True)
class Picture:
    """An image as recorded: raw pixels, or with ``width == 0`` the content of a file of kind `encoding`."""

    stamp_ns: int
    frame_id: str
    encoding: str
    data: Any  # bytes or (n,) uint8
    width: int = 0
    height: int = 0
    step: int = 0
    big_endian: bool = False


@dataclass(frozen=True)
class Info:
    """A camera: `message` has the attributes of a CameraInfo of ROS 2."""

    stamp_ns: int
    frame_id: str
    message: Any


@dataclass(frozen=True)
class Transform:
    """Points of frame `child` in frame `parent`: metres, quaternion x y z w."""

    parent: str
    child: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


def stamp_ns(channel: Channel, start: Callable[[int], bytes]) -> int | None:
    """The time in a message's header by its first bytes, `start(n)`; None if that needs the whole message."""
    if channel.type not in WITH_HEADER or channel.encoding not in ("ros1", "cdr"):
        return None
    data = start(16)
    if len(data) < 12:
        raise ValueError(f"{channel.topic}: a message is not whole")
    if channel.encoding == "ros1":
        sec, nanosec = struct.unpack_from("<II", data, 4)
    else:
        sec, nanosec = struct.unpack_from("<iI" if data[1] & 1 else ">iI", data, 4)
    return int(sec) * 10**9 + int(nanosec)


class Decoder:
    """Decodes a message by its channel; the libraries are loaded at the first message that needs them."""

    def __init__(self) -> None:
        self._stores: dict[str, Any] = {}
        self._protobuf: dict[int, Any] = {}

    def __call__(self, channel: Channel, data: bytes) -> Any:
        """Picture, Info, Transform or a list of them, else the message of ROS; ValueError for one that is not whole."""
        about = f"{channel.topic}: a message of type {channel.type} cannot be decoded"
        try:
            if channel.encoding in ("ros1", "cdr"):
                store = self._stores.get(channel.encoding) or self._store(channel.encoding)
                read = store.deserialize_ros1 if channel.encoding == "ros1" else store.deserialize_cdr
                return _of_ros(channel.type, read(data, channel.type))
            if channel.encoding == "protobuf":
                return _of_foxglove(channel.type, self._decoder(channel)(data))
            if channel.encoding == "json":
                message = json.loads(data, object_hook=lambda fields: SimpleNamespace(**fields))
                return _of_foxglove(channel.type, message)
        except (ImportError, MemoryError):
            raise
        except Exception as error:  # each library has its own, and messages may be damaged anywhere
            raise ValueError(f"{about} ({reason_of(error)})") from None
        raise ValueError(
            f"{channel.topic}: expected messages encoded as ros1, cdr, protobuf or json, got {channel.encoding!r}"
        )

    def _store(self, encoding: str) -> Any:
        typesys = need("rosbags.typesys", "bags")
        if encoding == "cdr":
            store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        else:
            store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
            for name in TRANSFORM_TYPES[:2]:
                if name not in store.types:
                    text = "geometry_msgs/TransformStamped[] transforms"
                    store.register(typesys.get_types_from_msg(text, name))
        self._stores[encoding] = store
        return store

    def _decoder(self, channel: Channel) -> Any:
        key = id(channel.schema)
        if key not in self._protobuf:
            factory = need("mcap_protobuf.decoder", "bags").DecoderFactory()
            self._protobuf[key] = factory.decoder_for("protobuf", channel.schema)
        if self._protobuf[key] is None:
            raise ValueError("its schema is missing")
        return self._protobuf[key]


def _of_ros(kind: str, m: Any) -> Any:
    if kind in TRANSFORM_TYPES:
        return [
            Transform(_id(t.header.frame_id), _id(t.child_frame_id), *_motion(t.transform))
            for t in m.transforms
        ]
    if kind == ROS_TRANSFORM:
        return Transform("", "", *_motion(m))
    if kind not in WITH_HEADER:
        return m
    stamp, frame = m.header.stamp.sec * 10**9 + m.header.stamp.nanosec, _id(m.header.frame_id)
    if kind == ROS_IMAGE:
        return Picture(stamp, frame, m.encoding, m.data, m.width, m.height, m.step, bool(m.is_bigendian))
    if kind == ROS_COMPRESSED:
        return Picture(stamp, frame, m.format, m.data)
    return Info(stamp, frame, m)


def _of_foxglove(kind: str, m: Any) -> Any:
    if kind == "foxglove.FrameTransforms":
        return [t for each in m.transforms for t in _of_foxglove("foxglove.FrameTransform", each)]
    if kind == "foxglove.FrameTransform":
        return [Transform(_id(m.parent_frame_id), _id(m.child_frame_id), *_motion(m))]
    t = m.timestamp
    stamp = (t.sec * 10**9 + t.nsec) if hasattr(t, "sec") else (t.seconds * 10**9 + t.nanos)
    frame = _id(m.frame_id)
    if kind in (FOX_IMAGE, FOX_COMPRESSED):
        data = base64.b64decode(m.data, validate=True) if isinstance(m.data, str) else m.data
        if kind == FOX_COMPRESSED:
            return Picture(stamp, frame, m.format, data)
        return Picture(stamp, frame, m.encoding, data, m.width, m.height, m.step)
    message = SimpleNamespace(
        width=m.width, height=m.height, distortion_model=m.distortion_model, d=list(m.D), k=list(m.K),
        p=list(getattr(m, "P", ())),
    )  # fmt: skip
    return Info(stamp, frame, message)


def _motion(m: Any) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    t, q = m.translation, m.rotation
    return (t.x, t.y, t.z), (q.x, q.y, q.z, q.w)


def _id(name: str) -> str:
    return name.lstrip("/")  # ROS 1 wrote frames with a slash
