# SPDX-License-Identifier: MIT
"""Recordings of the RealSense SDK and viewer: .db3 (rosbag2's schema), and the older .bag (ROS 1)."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from sdftrack.camera import RGBDCamera
from sdftrack.io.datasets import realsense_bag, realsense_db3
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.io.datasets.streams import StreamFrames

__all__ = ["open_realsense"]


def _detect(root: Path) -> bool:
    return root.is_file() and (realsense_db3.detect(root) or realsense_bag.detect(root))


@register("realsense", "a file .db3 or .bag with topics /device_0/sensor_0/", _detect)
def open_realsense(path: Path) -> Sequence:
    reader = realsense_db3 if realsense_db3.detect(path) else realsense_bag
    streams, depth_scale, close = reader.read_streams(path)
    try:
        if "Depth" not in streams:
            found = ", ".join(streams) or "none"
            raise ValueError(
                f"{path}: the recording has no depth stream, which the trackers require; its streams: {found}"
            )
        depth, color = streams["Depth"], streams.get("Color")
        if depth_scale is None:
            warnings.warn(f"{path}: the depth units are not recorded; 1 mm is assumed", stacklevel=3)
            depth_scale = 0.001
        camera = RGBDCamera(depth.camera())
        if color is not None:
            T = color.T_stream_ref @ np.linalg.inv(depth.T_stream_ref)
            lens = color.camera()
            aligned = lens == camera.depth and np.allclose(T, np.eye(4), atol=1e-6)
            if not aligned:
                camera = RGBDCamera(camera.depth, lens, T_color_depth=T)
        frames = StreamFrames(path.name, depth.stream, color.stream if color else None, depth_scale)
        return Sequence(frames, camera, layout="realsense", name=path.stem, close=close)
    except BaseException:
        close()
        raise
