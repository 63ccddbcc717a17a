# SPDX-License-Identifier: MIT
"""Stand-ins for rclpy and ROS messages with the names that docs/howto uses."""

from types import ModuleType, SimpleNamespace

import numpy as np


def millimetres(frame):
    return np.round(1000 * frame.depth).astype(np.uint16)


def depth_message(frame):
    pixels = millimetres(frame)
    stamp = SimpleNamespace(sec=int(frame.index), nanosec=0)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=stamp, frame_id="depth"), encoding="16UC1",
        height=pixels.shape[0], width=pixels.shape[1], step=2 * pixels.shape[1], data=pixels.tobytes(),
    )  # fmt: skip


def camera_message(camera):
    return SimpleNamespace(
        k=camera.K.ravel(), d=[], distortion_model="plumb_bob", width=camera.width, height=camera.height
    )


def ros(frames, camera, published):
    """The modules; `rclpy.spin` sends the camera and the frames to the node, whose poses go to `published`."""

    class Node:
        def __init__(self, name):
            self.calls = {}

        def create_publisher(self, kind, topic, depth):
            return SimpleNamespace(publish=published.append)

        def create_subscription(self, kind, topic, callback, depth):
            self.calls[kind] = callback

    def spin(node):
        node.calls["Image"](depth_message(frames[0]))  # before the camera is known
        node.calls["CameraInfo"](camera_message(camera))
        for frame in frames:
            node.calls["Image"](depth_message(frame))

    def pose_message():
        pose = SimpleNamespace(position=SimpleNamespace(), orientation=SimpleNamespace())
        return SimpleNamespace(header=None, pose=SimpleNamespace(pose=pose, covariance=None))

    contents = {
        "rclpy": {"init": lambda: None, "spin": spin}, "rclpy.node": {"Node": Node}, "sensor_msgs": {},
        "sensor_msgs.msg": {"CameraInfo": "CameraInfo", "Image": "Image"}, "geometry_msgs": {},
        "geometry_msgs.msg": {"PoseWithCovarianceStamped": pose_message},
    }  # fmt: skip
    modules = {}
    for name, members in contents.items():
        modules[name] = ModuleType(name)
        vars(modules[name]).update(members)
    return modules
