# SPDX-License-Identifier: MIT
"""Bags for tests: the same messages written as ROS 1, ROS 2 and Foxglove recordings, by the formats' own libraries."""

import base64
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sdftrack as st

pytest.importorskip("rosbags")
pytest.importorskip("mcap")

IMAGE, COMPRESSED, INFO = "Image", "CompressedImage", "CameraInfo"
TRANSFORM = "Transform"
ROS_TYPES = {name: f"sensor_msgs/msg/{name}" for name in (IMAGE, COMPRESSED, INFO)}
ROS_TYPES[TRANSFORM] = "tf2_msgs/msg/TFMessage"
FOX_TYPES = {
    IMAGE: "RawImage", COMPRESSED: "CompressedImage", INFO: "CameraCalibration",
    TRANSFORM: "FrameTransform",
}  # fmt: skip
DEPTH_TOPIC, COLOR_TOPIC = "/camera/depth/image_raw", "/camera/color/image_raw"
DEPTH_FRAME, COLOR_FRAME = "depth_optical", "color_optical"
T0_NS = 1_700_000_000_123_456_789


@dataclass(frozen=True)
class Message:
    """A message; `stamp` is in the header (ns), `recorded` is when it was written, by default later as by a driver.

    A `kind` of none of the formats is a type of ROS 1, whose `values` may be tuples (type, arguments).
    """

    topic: str
    kind: str
    stamp: int
    frame_id: str
    values: dict[str, Any] = field(default_factory=dict)
    recorded: int = -1

    @property
    def time(self) -> int:
        return self.stamp + 5_000_000 if self.recorded < 0 else self.recorded


def image(topic: str, stamp: int, frame_id: str, pixels: np.ndarray, encoding: str, **also: Any) -> Message:
    """`step` and `is_bigendian` may be given; `pixels` is then what these make of the image's bytes."""
    values = {
        "height": pixels.shape[0], "width": pixels.shape[1], "encoding": encoding, "is_bigendian": 0,
        "step": pixels.nbytes // pixels.shape[0],
        "data": np.ascontiguousarray(pixels).view(np.uint8).ravel(),
    }  # fmt: skip
    return Message(topic, IMAGE, stamp, frame_id, {**values, **also})


def compressed(topic: str, stamp: int, frame_id: str, data: bytes, text: str) -> Message:
    return Message(
        topic, COMPRESSED, stamp, frame_id, {"format": text, "data": np.frombuffer(data, np.uint8)}
    )


def info(
    topic: str, stamp: int, frame_id: str, camera: st.Camera, model: str = "plumb_bob", **also: Any
) -> Message:
    P = np.hstack([camera.K, np.zeros((3, 1))]).ravel()
    D = np.array(camera.distortion or (0.0,) * 5)
    values = {"height": camera.height, "width": camera.width, "distortion_model": model, "d": D}
    values |= {"k": camera.K.ravel(), "r": np.eye(3).ravel(), "p": P, "binning_x": 0, "binning_y": 0}
    return Message(topic, INFO, stamp, frame_id, {**values, **also})


def transform(
    parent: str, child: str, T: np.ndarray, stamp: int = T0_NS, topic: str = "/tf_static"
) -> Message:
    """T_parent_child."""
    values = {"child": child, "t": T[:3, 3].tolist(), "q": Rotation.from_matrix(T[:3, :3]).as_quat().tolist()}
    return Message(topic, TRANSFORM, stamp, parent, values)


def recording(
    seq: st.Sequence, T_color_depth: np.ndarray | None = None, color_delay_ns: int = 2_000_000
) -> list[Message]:
    """Depth (16UC1) and colour (rgb8) of a sequence; without T_color_depth, both in the frame of the depth camera."""
    color_frame = DEPTH_FRAME if T_color_depth is None else COLOR_FRAME
    camera = seq.camera.color or seq.camera.depth
    found = []
    if T_color_depth is not None:  # by way of a common frame, as drivers publish it
        T_link_depth = st.geometry.pose([0.1, -0.2, 0.3], [0.01, 0.02, 0.03])
        found.append(transform("link", DEPTH_FRAME, T_link_depth))
        found.append(transform("link", COLOR_FRAME, T_link_depth @ np.linalg.inv(T_color_depth)))
    for i, frame in enumerate(seq):
        stamp = T0_NS + i * 33_333_333
        found.append(info("/camera/depth/camera_info", stamp, DEPTH_FRAME, seq.camera.depth))
        found.append(image(DEPTH_TOPIC, stamp, DEPTH_FRAME, millimetres(frame), "16UC1"))
        if frame.color is not None:
            late = stamp + color_delay_ns
            found.append(info("/camera/color/camera_info", late, color_frame, camera))
            found.append(image(COLOR_TOPIC, late, color_frame, frame.color, "rgb8"))
    return found


def millimetres(frame: st.Frame) -> np.ndarray:
    return np.round(1000 * frame.depth).astype(np.uint16)


# -- Formats
FORMATS = ("ros1", "ros1-lz4", "ros1-bz2", "db3", "db3-zstd", "ros2-mcap", "mcap-loose", "protobuf", "json")
LAYOUTS = {"protobuf": "mcap", "json": "mcap", "ros2-mcap": "ros2", "mcap-loose": "ros2"}


def layout_of(kind: str) -> str:
    return LAYOUTS.get(kind, "ros1" if kind.startswith("ros1") else "ros2")


def write(folder: Path, messages: list[Message], kind: str, name: str = "bag") -> Path:
    """Write a recording of format `kind` into the folder; returns what open_sequence takes."""
    if kind.startswith("ros1"):
        return write_ros1(folder / f"{name}.bag", messages, kind.partition("-")[2])
    if kind in ("db3", "db3-zstd", "ros2-mcap"):
        return write_ros2(folder / name, messages, kind)
    return write_mcap(folder / f"{name}.mcap", messages, kind)


def _store(ros1: bool) -> Any:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    if ROS_TYPES[TRANSFORM] not in store.types:
        store.register(
            get_types_from_msg("geometry_msgs/TransformStamped[] transforms", ROS_TYPES[TRANSFORM])
        )
    return store


def ros_bytes(store: Any, message: Message, ros1: bool) -> bytes:
    types = store.types

    def header() -> Any:
        stamp = types["builtin_interfaces/msg/Time"](*divmod(message.stamp, 10**9))
        also = {"seq": 0} if ros1 else {}
        return types["std_msgs/msg/Header"](stamp=stamp, frame_id=message.frame_id, **also)

    kind, values = ROS_TYPES.get(message.kind, message.kind), dict(message.values)
    if message.kind not in ROS_TYPES:
        nested = {name: types[v[0]](*v[1]) for name, v in values.items() if isinstance(v, tuple)}
        made = types[kind](**{**values, **nested})
    elif message.kind == TRANSFORM:
        t = types["geometry_msgs/msg/Vector3"](*values["t"])
        q = types["geometry_msgs/msg/Quaternion"](*values["q"])
        one = types["geometry_msgs/msg/TransformStamped"](
            header=header(),
            child_frame_id=values["child"],
            transform=types["geometry_msgs/msg/Transform"](translation=t, rotation=q),
        )
        made = types[kind](transforms=[one])
    else:
        if message.kind == INFO:
            values["roi"] = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
            if ros1:
                values = {n.upper() if len(n) == 1 else n: v for n, v in values.items()}
        made = types[kind](header=header(), **values)
    return bytes(store.serialize_ros1(made, kind) if ros1 else store.serialize_cdr(made, kind))


def write_ros1(path: Path, messages: list[Message], compression: str = "", types: str = "") -> Path:
    """`types`: the definition of ``realsense_msgs/msg/StreamInfo``, where one is written."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import get_types_from_msg

    store, writer = _store(True), Writer(path)
    if types:
        store.register(get_types_from_msg(types, "realsense_msgs/msg/StreamInfo"))
    if compression:
        writer.set_compression(getattr(Writer.CompressionFormat, compression.upper()))
    with writer:
        topics = {}
        for m in sorted(messages, key=lambda m: m.time):
            if m.topic not in topics:
                kind = ROS_TYPES.get(m.kind, m.kind)
                topics[m.topic] = writer.add_connection(m.topic, kind, typestore=store)
            writer.write(topics[m.topic], m.time, ros_bytes(store, m, True))
    return path


def write_ros2(folder: Path, messages: list[Message], kind: str = "db3") -> Path:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    plugin = StoragePlugin.MCAP if kind == "ros2-mcap" else StoragePlugin.SQLITE3
    store, writer = _store(False), Writer(folder, version=9, storage_plugin=plugin)
    if kind.endswith("-zstd"):
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    if kind.endswith("-file"):
        writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    with writer:
        topics = {}
        for m in sorted(messages, key=lambda m: m.time):
            if m.topic not in topics:
                topics[m.topic] = writer.add_connection(m.topic, ROS_TYPES[m.kind], typestore=store)
            writer.write(topics[m.topic], m.time, ros_bytes(store, m, False))
    return folder


def write_mcap(path: Path, messages: list[Message], kind: str, **options: Any) -> Path:
    """`kind` "protobuf" or "json": Foxglove's schemas; "mcap-loose": ROS 2 as its fastest preset, neither chunks nor
    an index; "mcap-ros2": chunks of the mcap library's writer with its `options`."""
    from mcap.writer import IndexType, Writer

    ros = kind.startswith("mcap-")
    store = _store(False) if ros else None
    if kind == "mcap-loose":
        options = {"use_chunking": False, "index_types": IndexType.NONE, "repeat_channels": False}
        options |= {"use_statistics": False, "use_summary_offsets": False}
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="ros2" if ros else "", library="test")
        topics = {}
        for m in sorted(messages, key=lambda m: m.time):
            if m.topic not in topics:
                if ros:
                    schema = writer.register_schema(ROS_TYPES[m.kind], "ros2msg", b"")
                else:
                    schema = _foxglove_schema(writer, FOX_TYPES[m.kind], kind)
                encoding = "cdr" if ros else kind
                topics[m.topic] = writer.register_channel(m.topic, encoding, schema)
            data = ros_bytes(store, m, False) if ros else _foxglove_bytes(m, kind)
            writer.add_message(topics[m.topic], m.time, data, m.time)
        writer.finish()
    return path


def _foxglove_class(name: str) -> Any:
    import importlib

    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)


def _foxglove_schema(writer: Any, name: str, kind: str) -> int:
    if kind == "json":
        return writer.register_schema(f"foxglove.{name}", "jsonschema", b"{}")
    from mcap_protobuf.schema import build_file_descriptor_set

    data = build_file_descriptor_set(_foxglove_class(name)).SerializeToString()
    return writer.register_schema(f"foxglove.{name}", "protobuf", data)


def _foxglove_bytes(m: Message, kind: str) -> bytes:
    sec, nsec = divmod(m.stamp, 10**9)
    values: dict[str, Any] = {"frame_id": m.frame_id}
    if m.kind == TRANSFORM:
        values = {"parent_frame_id": m.frame_id, "child_frame_id": m.values["child"]}
        values["translation"] = dict(zip("xyz", m.values["t"], strict=True))
        values["rotation"] = dict(zip("xyzw", m.values["q"], strict=True))
    elif m.kind == INFO:
        values |= {n: m.values[n] for n in ("width", "height", "distortion_model")}
        values |= {n: np.asarray(m.values[n.lower()]).tolist() for n in "DKRP"}
    else:
        values |= {n: v for n, v in m.values.items() if n not in ("data", "is_bigendian")}
        values["data"] = m.values["data"].tobytes()
    if kind == "json":
        if "data" in values:
            values["data"] = base64.b64encode(values["data"]).decode()
        return json.dumps({"timestamp": {"sec": sec, "nsec": nsec}, **values}).encode()
    made = _foxglove_class(FOX_TYPES[m.kind])(**values)
    made.timestamp.seconds, made.timestamp.nanos = sec, nsec
    return made.SerializeToString()
