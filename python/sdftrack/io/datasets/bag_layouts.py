# SPDX-License-Identifier: MIT
"""Bags as sequences: the layouts ros1, ros2 and mcap."""

from __future__ import annotations

from pathlib import Path

from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.mcap_file import profile
from sdftrack.io.datasets.bags.opening import sequence_of
from sdftrack.io.datasets.bags.recording import is_recording, open_parts
from sdftrack.io.datasets.bags.rosbag1 import Rosbag1
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.sequence import Sequence

__all__ = ["open_mcap", "open_ros1", "open_ros2"]

TOPICS = ("depth_topic", "color_topic")


def _is_ros2(path: Path) -> bool:
    if path.is_dir():
        return is_recording(path)
    return path.suffix == ".db3" or (path.suffix == ".mcap" and profile(path) == "ros2")


@register("ros1", "a ROS 1 .bag file", lambda path: path.is_file() and path.suffix == ".bag", TOPICS)
def open_ros1(path: Path, depth_topic: str | None = None, color_topic: str | None = None) -> Sequence:
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: the file is empty")
    return sequence_of(Bag(path, [Rosbag1(path)]), "ros1", depth_topic, color_topic)


@register("ros2", "a ROS 2 folder with metadata.yaml, a .db3 or .mcap file", _is_ros2, TOPICS)
def open_ros2(path: Path, depth_topic: str | None = None, color_topic: str | None = None) -> Sequence:
    return sequence_of(Bag(path, open_parts(path)), "ros2", depth_topic, color_topic)


@register("mcap", "a Foxglove .mcap file", lambda path: path.is_file() and path.suffix == ".mcap", TOPICS)
def open_mcap(path: Path, depth_topic: str | None = None, color_topic: str | None = None) -> Sequence:
    return sequence_of(Bag(path, open_parts(path)), "mcap", depth_topic, color_topic)
