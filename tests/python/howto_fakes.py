# SPDX-License-Identifier: MIT
"""Stand-ins for pyrealsense2, rclpy and ROS messages with the names that docs/howto uses."""

from types import ModuleType, SimpleNamespace

import numpy as np


def millimetres(frame):
    return np.round(1000 * frame.depth).astype(np.uint16)


def realsense(frames, camera):
    """The module, whose pipeline gives the frames of a sequence again and again."""

    def stream_profile(name):
        intrinsics = SimpleNamespace(
            fx=camera.fx, fy=camera.fy, ppx=camera.cx, ppy=camera.cy, width=camera.width, height=camera.height,
            model="distortion.brown_conrady", coeffs=[0.0] * 5,
        )  # fmt: skip
        return SimpleNamespace(
            stream_type=lambda: f"stream.{name}",
            as_video_stream_profile=lambda: stream_profile(name),
            get_intrinsics=lambda: intrinsics,
            get_extrinsics_to=lambda other: SimpleNamespace(
                rotation=np.eye(3).ravel(), translation=[0, 0, 0]
            ),
        )

    sensor = SimpleNamespace(get_depth_scale=lambda: 0.001)
    profile = SimpleNamespace(
        get_streams=lambda: [stream_profile("depth"), stream_profile("color")],
        get_device=lambda: SimpleNamespace(first_depth_sensor=lambda: sensor),
    )
    given = [0]

    def wait_for_frames():
        frame = frames[given[0] % len(frames)]
        given[0] += 1
        return SimpleNamespace(
            get_depth_frame=lambda: SimpleNamespace(get_data=lambda: millimetres(frame)),
            get_color_frame=lambda: SimpleNamespace(get_data=lambda: frame.color),
            get_timestamp=lambda: 1000 * given[0] / 30,
        )

    module = ModuleType("pyrealsense2")
    module.stream = SimpleNamespace(depth="depth", color="color")
    module.format = SimpleNamespace(z16="z16", rgb8="rgb8")
    module.config = lambda: SimpleNamespace(enable_stream=lambda *of: None)
    module.align = lambda stream: SimpleNamespace(process=lambda images: images)
    module.pipeline = lambda: SimpleNamespace(
        start=lambda config: profile, wait_for_frames=wait_for_frames, stop=lambda: None
    )
    return {"pyrealsense2": module}


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
        "rclpy": {"init": lambda: None, "spin": spin},
        "rclpy.node": {"Node": Node},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"CameraInfo": "CameraInfo", "Image": "Image"},
        "geometry_msgs": {},
        "geometry_msgs.msg": {"PoseWithCovarianceStamped": pose_message},
    }
    modules = {}
    for name, members in contents.items():
        modules[name] = ModuleType(name)
        vars(modules[name]).update(members)
    return modules
