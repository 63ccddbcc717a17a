# SPDX-License-Identifier: MIT
"""Bags as sequences, the layouts ros1, ros2 (a file, or a folder with metadata.yaml) and mcap: topics, cameras, and the
mapping from depth to colour.
"""

from __future__ import annotations

import contextlib
import re
import warnings
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import closed_on_error
from sdftrack._internal.text_files import in_order, named
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.io.datasets.bags.bag import Bag, Messages, Part, Topic
from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.datasets.bags.mcap_file import McapFile, profile
from sdftrack.io.datasets.bags.pictures import color_of, depth_of
from sdftrack.io.datasets.bags.rosbag1 import Rosbag1
from sdftrack.io.datasets.bags.sqlite_file import SqliteFile
from sdftrack.io.datasets.bags.topics import (
    choose_color,
    choose_depth,
    find_camera,
    fixed_transforms,
    models_of,
    transform_between,
    true_poses,
)
from sdftrack.io.datasets.sequence import Sequence, register
from sdftrack.io.frames import Expected, size_text

# Depth images that drivers register to the colour camera: RealSense, Azure Kinect, OpenNI.
REGISTERED = re.compile(r"aligned_depth_to_color|depth_to_(rgb|color)|depth_registered", re.IGNORECASE)
TOPICS = ("depth_topic", "color_topic")
METADATA = "metadata.yaml"
MARK = "rosbag2_bagfile_information"
LOOKED_AT = 10  # frames at the beginning
DEFAULT_PERIOD_NS = 10**9 // 30


def sequence_of(bag: Bag, layout: str, depth_topic: str | None, color_topic: str | None) -> Sequence:
    """The sequence of a bag, which it closes; on an error the bag is closed at once."""
    with closed_on_error(bag):
        try:
            return _sequence_of(bag, layout, depth_topic, color_topic)
        except ValueError as error:
            if bag.damage:  # the likely reason
                raise ValueError(f"{error} ({bag.damage})") from None
            raise


def _sequence_of(bag: Bag, layout: str, depth_topic: str | None, color_topic: str | None) -> Sequence:
    depth = choose_depth(bag, depth_topic)
    color = choose_color(bag, color_topic, depth)
    if bag.damage:
        told = f"{bag.path}: {bag.damage}; what is whole is used: {depth.count} depth images"
        warnings.warn(told, stacklevel=6)
    picture, size = _example(bag, depth, colored=False)
    own, others = find_camera(bag, depth.name, picture.frame_id, size)
    if own is None:
        raise ValueError(
            f"{bag.path}: no camera of {depth.name} (frame {picture.frame_id!r}): expected a topic camera_info beside "
            f"it, or one of the same frame; topics with cameras: {others}"
        )
    # A wrong unit or camera is an error now, instead of bad frames.
    image, scale = depth_of(picture, depth.name)
    if image.shape != own.shape:
        raise ValueError(
            f"{bag.path}: images of {size_text(image.shape)} pixels on {depth.name} with a camera of "
            f"{size_text(own.shape)}; is this the depth image's camera?"
        )
    with named(f"{bag.path}, {depth.name}"):
        Frame(image, depth_scale=scale)
    camera, reason = RGBDCamera(own), ""
    if color is not None:
        camera, reason = _with_color(bag, own, depth, color, picture)
        if reason:
            told = f"{bag.path}: colour images of {color.name} are ignored: {reason}"
            warnings.warn(told, stacklevel=6)
    frames = BagFrames(bag, depth.name, "" if color is None else color.name, camera, use_color=not reason)
    objects, poses = true_poses(bag, depth.name)
    return Sequence(
        frames, camera, poses, models_of(bag.path) if poses else {}, objects=objects or None, layout=layout,
        name=bag.path.stem, close=bag.close,
    )  # fmt: skip


def _with_color(
    bag: Bag, own: Camera, depth: Topic, color: Topic, picture: Picture
) -> tuple[RGBDCamera, str]:
    alone = RGBDCamera(own)
    try:
        other, size = _example(bag, color, colored=True)
        lens, _ = find_camera(bag, color.name, other.frame_id, size)
    except ValueError as error:
        return alone, str(error)
    registered = REGISTERED.search(depth.name)
    fits = lens is not None and (lens.width, lens.height) == size
    if picture.frame_id == other.frame_id != "" or registered:
        if size == (own.width, own.height) and (lens is None or lens == own or registered):
            return alone, ""
        if fits:  # other pixels of the same rays
            return RGBDCamera(own, lens, T_color_depth=np.eye(4)), ""
        return alone, f"they have {size[0]} x {size[1]} pixels and no camera_info of that size"
    T_color_depth = transform_between(fixed_transforms(bag), other.frame_id, picture.frame_id)
    if T_color_depth is not None and fits:
        return RGBDCamera(own, lens, T_color_depth=T_color_depth), ""
    lacks = f"no camera_info of {size[0]} x {size[1]} pixels beside them"
    if T_color_depth is None:
        between = f"from frame {picture.frame_id!r} to {other.frame_id!r}"
        lacks = f"no fixed transform {between} (record /tf_static)"
    return alone, f"{lacks}; or choose a depth image aligned to colour by depth_topic="


def _example(bag: Bag, topic: Topic, colored: bool) -> tuple[Picture, tuple[int, int]]:
    messages, reasons = bag.messages(topic.name), []
    for i in range(min(LOOKED_AT, len(messages))):
        try:
            picture: Picture = messages[i]
            name = f"{topic.name}, message {i}"
            image = color_of(picture, name) if colored else depth_of(picture, name)[0]
        except ValueError as error:
            reasons.append(str(error))
            continue
        return picture, (image.shape[1], image.shape[0])
    raise ValueError(f"{bag.path}: none of the first {len(reasons)} images can be read: {reasons[0]}")


def _is_ros2(path: Path) -> bool:
    if path.is_dir():
        return is_recording(path)
    return path.suffix == ".db3" or (path.suffix == ".mcap" and profile(path) == "ros2")


def _open_bag(
    layout: str, path: Path, depth_topic: str | None = None, color_topic: str | None = None
) -> Sequence:
    if path.is_file() and path.stat().st_size == 0:
        raise ValueError(f"{path}: the file is empty")
    parts: list[Part] = [Rosbag1(path)] if layout == "ros1" else open_parts(path)
    return sequence_of(Bag(path, parts), layout, depth_topic, color_topic)


for _layout, _marks, _detect in (
    ("ros1", "a ROS 1 .bag file", lambda path: path.is_file() and path.suffix == ".bag"),
    ("ros2", "a ROS 2 folder with metadata.yaml, a .db3 or .mcap file", _is_ros2),
    ("mcap", "a Foxglove .mcap file", lambda path: path.is_file() and path.suffix == ".mcap"),
):
    register(_layout, _marks, _detect, TOPICS)(partial(_open_bag, _layout))


def is_recording(folder: Path) -> bool:
    """By metadata.yaml, which an interrupted recording lacks; then by the names of its files, NAME_0, NAME_1, ..."""
    metadata = folder / METADATA
    if metadata.is_file():
        return MARK in metadata.read_text(encoding="utf-8", errors="replace")
    names = [p for p in folder.iterdir() if p.suffix in (".db3", ".mcap")] if folder.is_dir() else []
    return len(names) > 0 and {re.sub(r"_\d+$", "", p.stem) for p in names} == {folder.resolve().name}


def open_parts(path: Path) -> list[Part]:
    """The files of a recording, opened; ValueError if one is missing or of another kind."""
    files, compression = ([path], "") if path.is_file() else _listed(path)
    parts: list[Part] = []
    try:
        for file in files:
            if not file.is_file():
                raise ValueError(f"{file}: the file is missing, but {METADATA} lists it")
            if file.stat().st_size == 0:
                raise ValueError(f"{file}: the file is empty")
            parts.append(McapFile(file) if file.suffix == ".mcap" else SqliteFile(file, compression))
    except BaseException:
        for part in parts:
            part.close()
        raise
    return parts


def _listed(folder: Path) -> tuple[list[Path], str]:
    text = ""
    files = in_order(p for p in folder.iterdir() if p.suffix in (".db3", ".mcap"))
    if (folder / METADATA).is_file():
        text = (folder / METADATA).read_text(encoding="utf-8", errors="replace")
        block = re.search(r"relative_file_paths:[ \t]*\n((?:\s*-\s*\S.*\n?)+)", text)
        if block:
            names = re.findall(r"-\s*[\"']?([^\"'\n]+?)[\"']?[ \t]*(?:\n|$)", block[1])
            files = [folder / Path(name).name for name in names]
    mode = (_value(text, "compression_mode") or "none").lower()
    if any(file.suffix == ".zstd" for file in files) or mode == "file":
        packed = [file for file in files if file.suffix == ".zstd" and not file.with_suffix("").is_file()]
        if packed:
            raise ValueError(
                f"{packed[0]}: the file is compressed as a whole, so its messages cannot be read one by one; "
                f"decompress it first: zstd -d {packed[0].name}"
            )
        files, mode = [f.with_suffix("") if f.suffix == ".zstd" else f for f in files], "none"
    if not files:
        raise ValueError(f"{folder}: expected .db3 or .mcap files in a ROS 2 recording, got none")
    return files, (_value(text, "compression_format") or "") if mode == "message" else ""


def _value(text: str, name: str) -> str | None:
    found = re.search(rf"^\s*{name}:\s*[\"']?([\w]+)", text, re.MULTILINE)
    return found[1] if found else None


class BagFrames:
    """Depth with the colour image nearest in time, read on access; what cannot be read is a `Frame.unreadable`. `depth`
    and `color` are topics, `color` "" for none; `use_color` is false if colour images do not fit the camera."""

    def __init__(self, bag: Bag, depth: str, color: str, camera: RGBDCamera, use_color: bool) -> None:
        self._bag, self._camera = bag, camera
        self._depth_topic, self._color_topic = depth, color
        self._depth = bag.messages(depth)
        self._color = bag.messages(color) if color else None
        self._use_color = use_color
        self._any_size = False
        self._most_apart_ns = period_ns(self._depth) / 2
        self._lag = 0  # of colour after depth in the order of recording, messages

    def __len__(self) -> int:
        return len(self._depth)

    def __getitem__(self, i: int) -> Frame:
        timestamp = None
        if self._bag.closed:
            raise ValueError(f"{self._bag.path}: the sequence is closed; open it again to read its frames")
        try:
            stamp = self._depth.stamp_ns(i)
            timestamp = 1e-9 * stamp
            name = f"{self._depth_topic}, message {i}"
            depth, scale = depth_of(self._depth[i], name)
            Expected("the camera", self._camera.depth.shape).check(depth.shape, name)
            color = self._color_image(i, stamp)
            return Frame(depth, color, timestamp, depth_scale=scale, index=i, check_units=False)
        except (ValueError, TypeError) as error:
            return Frame.unreadable(str(error), timestamp, i)

    def take_color_of_any_size(self) -> None:
        self._use_color = self._any_size = True

    def _color_image(self, i: int, stamp: int) -> NDArray[np.uint8] | None:
        j = self._nearest(self._color, i, stamp) if self._color is not None and self._use_color else None
        if self._color is None or j is None:
            return None
        name = f"{self._color_topic}, message {j}"
        color = color_of(self._color[j], name)
        if not self._any_size:
            Expected("its camera", (self._camera.color or self._camera.depth).shape).check(color.shape, name)
        return color

    def _nearest(self, color: Messages, i: int, stamp: int) -> int | None:
        """The colour image nearest in time, or None beyond half a frame. Times in the headers are those of the
        exposure, but reading them all would read the whole file: the search begins at the time of recording and goes on
        as long as the gap shrinks."""

        def gap(k: int) -> int:
            try:
                return abs(color.stamp_ns(k) - stamp)
            except ValueError:  # not whole
                return 1 << 62

        begin = int(np.searchsorted(color.recorded_ns(), self._depth.recorded_ns()[i]))
        j = min(max(begin + self._lag, 0), len(color) - 1)
        best = gap(j)
        for step in (-1, 1):
            missed = 0
            k = j + step
            while 0 <= k < len(color) and missed < 2:  # over one message that is out of order
                if gap(k) < best:
                    j, best, missed = k, gap(k), 0
                else:
                    missed += 1
                k += step
        self._lag = j - begin
        return j if best <= self._most_apart_ns else None


def period_ns(messages: Messages) -> float:
    stamps = []
    for i in range(min(LOOKED_AT, len(messages))):
        with contextlib.suppress(ValueError):
            stamps.append(messages.stamp_ns(i))
    steps = np.diff(stamps)
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else DEFAULT_PERIOD_NS
