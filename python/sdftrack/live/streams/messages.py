# SPDX-License-Identifier: MIT
"""One frame's result as plain values and as ROS 2 messages: what streams send, without a network."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import quaternion
from sdftrack.camera import Camera
from sdftrack.io.report_file import object_entry, plain
from sdftrack.io.ros2 import DEPTH_FRAME, INFO, RosTypes
from sdftrack.live.streams.stream import Packet, safe_names
from sdftrack.results import Status

VERSION = 1  # of the JSON messages, docs/reference/stream.schema.json
UNKNOWN_VARIANCE = 1e6  # m^2 and rad^2: filters that read ROS messages take it as "says nothing"
_KEPT = ("name", "status", "reason", "confidence")
Array = NDArray[np.float64]


def frame_message(packet: Packet, names: Sequence[str], camera: Camera) -> dict[str, Any]:
    """The message of docs/reference/stream.schema.json: metres, radians, seconds, None where unknown, never NaN."""
    result = packet.result
    return {
        "version": VERSION,
        "index": packet.index,
        "timestamp": plain(packet.timestamp),
        "sent": packet.sent,
        "camera": {key: getattr(camera, key) for key in ("width", "height", "fx", "fy", "cx", "cy")},
        "objects": [_object(packet, k, name_of(names, k)) for k in range(len(result.poses))],
    }


def _object(packet: Packet, k: int, name: str) -> dict[str, Any]:
    result = packet.result
    entry = object_entry(result, k, k + 1, name)
    pose = None
    if entry["pose"] is not None:
        position, rotation = position_and_quaternion(result.poses[k])
        pose = {"position": position, "quaternion": rotation}
    twist = result.twists[k]
    motion = {"motion": dict(packet.motion[k])} if packet.motion is not None else {}
    return {
        **{key: entry[key] for key in _KEPT}, "pose": pose, "covariance": entry["covariance"],
        "twist": plain(twist) if np.isfinite(twist).all() else None, **motion,
    }  # fmt: skip


def position_and_quaternion(T: Array) -> tuple[list[float], list[float]]:
    return T[:3, 3].tolist(), quaternion(T[:3, :3]).tolist()


def ros_covariance(covariance: Array) -> Array:
    """(36,) row by row of a covariance (6, 6) of a result, whose order and axes are ROS's. Of (x, y, z, rotations about
    x, y, z) in the axes of the message's frame. Without one, each variable has `UNKNOWN_VARIANCE`: ROS reads zeros as
    certain."""
    known: Array = covariance if np.isfinite(covariance).all() else UNKNOWN_VARIANCE * np.eye(6)
    return known.reshape(36)


def name_of(names: Sequence[str], k: int) -> str:
    """Name of object k, also of one added after the stream was opened."""
    return names[k] if k < len(names) else f"object_{k}"


POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
TF, CAMERA = "/tf", "/sdftrack/camera_info"  # topics


class RosMessages:
    """Makes messages as (topic, type, bytes); objects that are lost are left out."""

    def __init__(self, names: Sequence[str], camera: Camera) -> None:
        self._ros = RosTypes()
        self.definition = self._ros.definition
        self._names, self._camera = safe_names(names), camera

    def topics(self) -> list[tuple[str, str]]:
        """(topic, type) of all messages about the objects that are known now, and of the camera's."""
        poses = [(_pose_topic(name), POSE) for name in self._names]
        return [*poses, (TF, TRANSFORMS), (CAMERA, INFO)]

    def of_frame(self, packet: Packet) -> Iterator[tuple[str, str, bytes]]:
        """A pose for each tracked object, then all of them on ``/tf``."""
        ros, result, transforms = self._ros, packet.result, []
        for k, T in enumerate(result.poses):
            if result.status[k] not in (Status.OK, Status.WEAK) or not np.isfinite(T).all():
                continue
            name, covariance = name_of(self._names, k), ros_covariance(result.covariances[k])
            kind = "geometry_msgs/msg/PoseWithCovariance"
            known = ros.make(kind, pose=ros.pose(T), covariance=covariance)
            header = ros.header(packet.time_ns, DEPTH_FRAME)
            yield _pose_topic(name), POSE, ros.serialized(POSE, header=header, pose=known)
            transforms.append(ros.transform(header, name, T))
        if transforms:
            yield TF, TRANSFORMS, ros.serialized(TRANSFORMS, transforms=transforms)

    def of_camera(self, packet: Packet) -> tuple[str, str, bytes]:
        header = self._ros.header(packet.time_ns, DEPTH_FRAME)
        return CAMERA, INFO, self._ros.camera_info(header, self._camera)


def _pose_topic(name: str) -> str:
    return f"/sdftrack/{name}/pose"
