# SPDX-License-Identifier: MIT
"""One frame's result as ROS 2 messages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sdftrack.camera import Camera
from sdftrack.io.ros_types import DEPTH_FRAME, INFO, RosTypes
from sdftrack.live.streams.addresses import safe_names
from sdftrack.live.streams.kinds import Packet
from sdftrack.live.streams.messages import name_of, ros_covariance, tracked

__all__ = ["RosMessages"]

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
        for k in range(len(result.poses)):
            if not tracked(result, k):
                continue
            name, T = name_of(self._names, k), result.poses[k]
            known = ros.make(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=ros.pose(T),
                covariance=ros_covariance(result.covariances[k]),
            )
            header = ros.header(packet.time_ns, DEPTH_FRAME)
            yield _pose_topic(name), POSE, ros.serialized(POSE, header=header, pose=known)
            transforms.append(ros.transform(header, name, T))
        if transforms:
            yield TF, TRANSFORMS, ros.serialized(TRANSFORMS, transforms=transforms)

    def of_camera(self, packet: Packet) -> tuple[str, str, bytes]:
        """The lens of the depth camera, at the time of a frame."""
        header = self._ros.header(packet.time_ns, DEPTH_FRAME)
        return CAMERA, INFO, self._ros.camera_info(header, self._camera)


def _pose_topic(name: str) -> str:
    return f"/sdftrack/{name}/pose"
