# SPDX-License-Identifier: MIT
"""Recordings of the RealSense SDK and viewer: .db3 (rosbag2's schema), and the older .bag (ROS 1)."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sdftrack.camera import RGBDCamera
from sdftrack.io.datasets import realsense_bag, realsense_db3
from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.rosbag1 import Rosbag1
from sdftrack.io.datasets.bags.sqlite_file import SqliteFile
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.realsense_stream import RealSenseStream
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.io.datasets.streams import StreamFrames

__all__ = ["open_realsense"]

Streams = tuple[dict[str, RealSenseStream], float | None]


def _detect(root: Path) -> bool:
    return root.is_file() and (realsense_db3.detect(root) or realsense_bag.detect(root))


@register("realsense", "a file .db3 or .bag with topics /device_0/sensor_0/", _detect)
def open_realsense(path: Path) -> Sequence:
    is_db3 = realsense_db3.detect(path)
    bag = Bag(path, [SqliteFile(path) if is_db3 else Rosbag1(path)])
    try:
        streams, depth_scale = _streams(
            bag, realsense_db3.read_streams if is_db3 else realsense_bag.read_streams
        )
        if "Depth" not in streams:
            found = ", ".join(streams) or "none"
            raise ValueError(
                f"{path}: the recording has no depth stream, which the trackers require; its streams: {found}"
            )
        depth, color = streams["Depth"], streams.get("Color")
        if depth_scale is None and bag.damage:
            raise ValueError(
                f"{path}: the recording cannot be read: its depth units are missing ({bag.damage})"
            )
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
        if bag.damage:
            count = len(depth.stream.stamps_s)
            warnings.warn(f"{path}: {bag.damage}; what is whole is used: {count} depth images", stacklevel=3)
        frames = StreamFrames(path.name, depth.stream, color.stream if color else None, depth_scale)
        return Sequence(frames, camera, layout="realsense", name=path.stem, close=bag.close)
    except BaseException:
        bag.close()
        raise


def _streams(bag: Bag, read: Callable[[Bag], Streams]) -> Streams:
    try:
        return read(bag)
    except (ValueError, KeyError, IndexError, struct.error) as error:
        lacks = f" ({bag.damage})" if bag.damage else ""
        raise ValueError(f"{bag.path}: the recording cannot be read: {error}{lacks}") from None
