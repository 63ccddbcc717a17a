# SPDX-License-Identifier: MIT
"""One frame's result as ROS 2 messages, serialised (CDR) without ROS."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from sdftrack._internal.extras import need
from sdftrack.camera import Camera
from sdftrack.live.streams.addresses import safe_names
from sdftrack.live.streams.kinds import Packet
from sdftrack.live.streams.messages import name_of, position_and_quaternion, ros_covariance, tracked

__all__ = ["CAMERA_FRAME", "RosMessages"]

CAMERA_FRAME = "camera_depth_optical_frame"  # z forward, x right, y down, as ROS's optical frames (REP 103)
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
INFO = "sensor_msgs/msg/CameraInfo"


class RosMessages:
    """Makes messages as (topic, type, bytes); objects that are lost are left out."""

    def __init__(self, names: Sequence[str], camera: Camera) -> None:
        need("rosbags", "bags")
        from rosbags.typesys import Stores, get_typestore

        self._store = get_typestore(Stores.ROS2_HUMBLE)
        self._names, self._camera = safe_names(names), camera

    def definition(self, kind: str) -> str:
        """The text of a type's definition with the types that it uses, as in ROS 2 bags."""
        text: str = self._store.generate_msgdef(kind, ros_version=2)[0]
        return text

    def of_frame(self, packet: Packet) -> Iterator[tuple[str, str, bytes]]:
        """A pose for each tracked object, then all of them on ``/tf``."""
        result, transforms = packet.result, []
        for k in range(len(result.poses)):
            if not tracked(result, k):
                continue
            name = name_of(self._names, k)
            (x, y, z), (qx, qy, qz, qw) = position_and_quaternion(result.poses[k])
            turn = self._make("geometry_msgs/msg/Quaternion", x=qx, y=qy, z=qz, w=qw)
            at = self._make("geometry_msgs/msg/Point", x=x, y=y, z=z)
            pose = self._make("geometry_msgs/msg/Pose", position=at, orientation=turn)
            known = self._make(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=pose,
                covariance=ros_covariance(result.covariances[k]),
            )
            header = self._header(packet.time_ns)
            yield self._written(f"/sdftrack/{name}/pose", POSE, header=header, pose=known)
            way = self._make(
                "geometry_msgs/msg/Transform",
                translation=self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
                rotation=turn,
            )
            transforms.append(
                self._make(
                    "geometry_msgs/msg/TransformStamped", header=header, child_frame_id=name, transform=way
                )
            )
        if transforms:
            yield self._written("/tf", TRANSFORMS, transforms=transforms)

    def of_camera(self, packet: Packet) -> tuple[str, str, bytes]:
        """The lens of the depth camera, at the time of a frame."""
        camera = self._camera
        region = self._make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        lens = np.zeros(8 if len(camera.distortion) == 8 else 5)  # ROS has k3 in plumb_bob
        lens[: len(camera.distortion)] = camera.distortion
        return self._written(
            "/sdftrack/camera_info", INFO, header=self._header(packet.time_ns),
            height=camera.height, width=camera.width, d=lens, k=camera.K.ravel(), r=np.eye(3).ravel(),
            p=np.hstack([camera.K, np.zeros((3, 1))]).ravel(), binning_x=0, binning_y=0, roi=region,
            distortion_model="rational_polynomial" if len(lens) == 8 else "plumb_bob",
        )  # fmt: skip

    def _header(self, time_ns: int) -> Any:
        seconds, rest = divmod(time_ns, 10**9)
        stamp = self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
        return self._make("std_msgs/msg/Header", stamp=stamp, frame_id=CAMERA_FRAME)

    def _make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _written(self, topic: str, kind: str, **fields: Any) -> tuple[str, str, bytes]:
        return topic, kind, bytes(self._store.serialize_cdr(self._make(kind, **fields), kind))
