# SPDX-License-Identifier: MIT
"""Messages of ROS 2 made of arrays and poses, serialised without ROS; and a file .mcap of them that stays readable up
to its last chunk, whatever happens."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack._internal.files import UnbufferedFile
from sdftrack._internal.rotations import quaternion
from sdftrack._internal.text_files import reason_of
from sdftrack.camera import Camera

# z forward, x right, y down, as ROS's optical frames (REP 103).
DEPTH_FRAME = "camera_depth_optical_frame"
COLOR_FRAME = "camera_color_optical_frame"
INFO = "sensor_msgs/msg/CameraInfo"
Array = NDArray[np.float64]


class RosTypes:
    """Makes messages of ROS 2's own types; needs the extra ``bags``."""

    def __init__(self) -> None:
        need("rosbags", "bags")
        from rosbags.typesys import Stores, get_typestore

        self._store = get_typestore(Stores.ROS2_HUMBLE)

    def definition(self, kind: str) -> str:
        return self._store.generate_msgdef(kind, ros_version=2)[0]

    def make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def serialized(self, kind: str, **fields: Any) -> bytes:
        return bytes(self._store.serialize_cdr(self.make(kind, **fields), kind))

    def header(self, time_ns: int, frame_id: str) -> Any:
        seconds, rest = divmod(time_ns, 10**9)
        stamp = self.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)

    def pose(self, T: Array) -> Any:
        """geometry_msgs/Pose of a (4, 4) pose, m."""
        at, turn = self._at("Point", T), self._turn(T)
        return self.make("geometry_msgs/msg/Pose", position=at, orientation=turn)

    def transform(self, header: Any, child: str, T_header_child: Array) -> Any:
        """geometry_msgs/TransformStamped: T maps points of the child's frame to that of the header."""
        at, turn = self._at("Vector3", T_header_child), self._turn(T_header_child)
        moved = self.make("geometry_msgs/msg/Transform", translation=at, rotation=turn)
        kind = "geometry_msgs/msg/TransformStamped"
        return self.make(kind, header=header, child_frame_id=child, transform=moved)

    def _at(self, kind: str, T: Array) -> Any:
        x, y, z = T[:3, 3].tolist()
        return self.make(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)

    def camera_info(self, header: Any, camera: Camera) -> bytes:
        region = self.make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        lens = np.zeros(8 if len(camera.distortion) == 8 else 5)  # ROS has k3 in plumb_bob
        lens[: len(camera.distortion)] = camera.distortion
        return self.serialized(
            INFO, header=header,
            height=camera.height, width=camera.width, d=lens, k=camera.K.ravel(), r=np.eye(3).ravel(),
            p=np.hstack([camera.K, np.zeros((3, 1))]).ravel(), binning_x=0, binning_y=0, roi=region,
            distortion_model="rational_polynomial" if len(lens) == 8 else "plumb_bob",
        )  # fmt: skip

    def _turn(self, T: Array) -> Any:
        x, y, z, w = quaternion(T[:3, :3]).tolist()
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


LATCHED = """- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""


class McapOutput:
    """Writes messages in chunks of `chunk_size` bytes, which a crash may lose; larger ones compress better.
    `definition` gives the definition of a message type."""

    def __init__(self, path: Path, definition: Callable[[str], str], chunk_size: int) -> None:
        need("mcap", "bags")
        from mcap.writer import Writer

        self._definition = definition
        output: Any = UnbufferedFile(path)
        self._file, self._writer = output, Writer(output, chunk_size=chunk_size)
        self._writer.start(profile="ros2", library="sdftrack")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self.counts: dict[str, tuple[str, int]] = {}  # topic -> type, number of messages
        self.times_ns = (0, 0)  # of the first and the last message
        self._whole = self._file.tell()

    def add(
        self, topic: str, kind: str, data: bytes, time_ns: int, sequence: int = 0, *, latched: bool = False
    ) -> None:
        """Add a serialised message; `latched`: for those who come later, as /tf_static."""
        if topic not in self._channels:
            if kind not in self._schemas:
                text = self._definition(kind).encode()
                self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", text)
            qos = LATCHED if latched else ""
            metadata = {"offered_qos_profiles": qos}
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind], metadata)
        self._writer.add_message(
            self._channels[topic], time_ns, data, publish_time=time_ns, sequence=sequence % 2**32
        )
        first, last = self.times_ns if self.counts else (time_ns, time_ns)
        self.times_ns = (min(first, time_ns), max(last, time_ns))
        self.counts[topic] = (kind, self.counts.get(topic, (kind, 0))[1] + 1)

    def attach(self, name: str, data: bytes, media_type: str) -> None:
        self._writer.add_attachment(0, 0, name, media_type, data)

    def flush(self) -> None:
        """End the chunk: what was added is in the file."""
        self._writer.flush()

    def mark_whole(self) -> None:
        self._whole = self._file.tell()

    def cut(self) -> None:
        self._file.truncate(self._whole)

    def finish(self) -> None:
        self._writer.finish()
        self._file.close()

    def close(self) -> None:
        self._file.close()


def copy_whole(path: Path, output: McapOutput, last_topic: str, count: int) -> None:
    """Copy messages in the order of the file up to the `count`-th one on `last_topic`. ValueError if the file holds
    fewer."""
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader

    found = 0
    with path.open("rb") as file:
        messages: Any = NonSeekingReader(file).iter_messages(log_time_order=False)
        try:
            while found < count:
                schema, channel, m = next(messages)
                latched = bool(channel.metadata.get("offered_qos_profiles"))
                output.add(channel.topic, schema.name, m.data, m.log_time, m.sequence, latched=latched)
                found += channel.topic == last_topic
        except (McapError, EOFError, StopIteration, ValueError, KeyError, struct.error) as error:
            raise ValueError(
                f"{path}: expected {count} whole frames, got {found} ({reason_of(error)})"
            ) from None
