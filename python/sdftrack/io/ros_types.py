# SPDX-License-Identifier: MIT
"""Messages of ROS 2 made of arrays and poses, serialised (CDR) without ROS."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack._internal.rotations import quaternion
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
        """The text of a type's definition with the types that it uses, as in ROS 2 bags."""
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
        x, y, z = T[:3, 3].tolist()
        return self.make(
            "geometry_msgs/msg/Pose",
            position=self.make("geometry_msgs/msg/Point", x=x, y=y, z=z),
            orientation=self._turn(T),
        )

    def transform(self, header: Any, child: str, T_header_child: Array) -> Any:
        """geometry_msgs/TransformStamped: T maps points of the child's frame to that of the header."""
        x, y, z = T_header_child[:3, 3].tolist()
        moved = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
            rotation=self._turn(T_header_child),
        )
        return self.make(
            "geometry_msgs/msg/TransformStamped", header=header, child_frame_id=child, transform=moved
        )

    def camera_info(self, header: Any, camera: Camera) -> bytes:
        """sensor_msgs/CameraInfo, serialised."""
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
