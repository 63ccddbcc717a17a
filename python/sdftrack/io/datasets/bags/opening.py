# SPDX-License-Identifier: MIT
"""A bag as a sequence: topics, cameras, and the mapping from depth to colour."""

from __future__ import annotations

import re
import warnings

import numpy as np

from sdftrack.camera import Camera, RGBDCamera
from sdftrack.io.datasets.bags.bag import Bag, Topic
from sdftrack.io.datasets.bags.decoding import Picture
from sdftrack.io.datasets.bags.frames import LOOKED_AT, BagFrames
from sdftrack.io.datasets.bags.pictures import color_of, depth_of
from sdftrack.io.datasets.bags.topics import choose_color, choose_depth, find_camera
from sdftrack.io.datasets.bags.transforms import fixed_transforms, models_of, transform_between, true_poses
from sdftrack.io.datasets.sequence import Sequence

__all__ = ["sequence_of"]

# Depth images that drivers register to the colour camera: RealSense, Azure Kinect, OpenNI.
REGISTERED = re.compile(r"aligned_depth_to_color|depth_to_(rgb|color)|depth_registered", re.IGNORECASE)


def sequence_of(bag: Bag, layout: str, depth_topic: str | None, color_topic: str | None) -> Sequence:
    """The sequence of a bag, which it closes; on an error the bag is closed at once."""
    try:
        depth = choose_depth(bag, depth_topic)
        color = choose_color(bag, color_topic, depth)
        if bag.damage:
            warnings.warn(
                f"{bag.path}: {bag.damage}; what is whole is used: {depth.count} depth images", stacklevel=5
            )
        picture, size = _example(bag, depth, colored=False)
        own = _camera(bag, depth, picture, size)
        camera, use_color = RGBDCamera(own), False
        if color is not None:
            camera, reason = _with_color(bag, own, depth, color, picture)
            use_color = not reason
            if reason:
                warnings.warn(
                    f"{bag.path}: colour images of {color.name} are ignored: {reason}", stacklevel=5
                )
        frames = BagFrames(bag, depth.name, "" if color is None else color.name, camera, use_color)
        objects, poses = true_poses(bag, depth.name)
        models = models_of(bag.path) if poses else {}
        return Sequence(
            frames,
            camera,
            poses,
            models,
            objects=objects or None,
            layout=layout,
            name=bag.path.stem,
            close=bag.close,
        )
    except ValueError as error:
        bag.close()
        if bag.damage:  # the likely reason
            raise ValueError(f"{error} ({bag.damage})") from None
        raise
    except BaseException:
        bag.close()
        raise


def _camera(bag: Bag, depth: Topic, picture: Picture, size: tuple[int, int]) -> Camera:
    camera, others = find_camera(bag, depth.name, picture.frame_id, size)
    if camera is None:
        raise ValueError(
            f"{bag.path}: no camera of {depth.name} (frame {picture.frame_id!r}): expected a topic camera_info beside "
            f"it, or one of the same frame; topics with cameras: {others}"
        )
    return camera


def _with_color(
    bag: Bag, own: Camera, depth: Topic, color: Topic, picture: Picture
) -> tuple[RGBDCamera, str]:
    """The camera with the mapping to colour; or without, and the reason."""
    try:
        other, size = _example(bag, color, colored=True)
        lens, _ = find_camera(bag, color.name, other.frame_id, size)
    except ValueError as error:
        return RGBDCamera(own), str(error)
    same_size = size == (own.width, own.height)
    if picture.frame_id == other.frame_id != "" or REGISTERED.search(depth.name):
        if same_size and (lens is None or lens == own or REGISTERED.search(depth.name)):
            return RGBDCamera(own), ""
        if lens is not None and (lens.width, lens.height) == size:  # other pixels of the same rays
            return RGBDCamera(own, lens, T_color_depth=np.eye(4)), ""
        return RGBDCamera(own), f"they have {size[0]} x {size[1]} pixels and no camera_info of that size"
    T_color_depth = transform_between(fixed_transforms(bag), other.frame_id, picture.frame_id)
    if T_color_depth is not None and lens is not None and (lens.width, lens.height) == size:
        return RGBDCamera(own, lens, T_color_depth=T_color_depth), ""
    if T_color_depth is None:
        lacks = (
            f"no fixed transform from frame {picture.frame_id!r} to {other.frame_id!r} (record /tf_static)"
        )
    else:
        lacks = f"no camera_info of {size[0]} x {size[1]} pixels beside them"
    return RGBDCamera(own), f"{lacks}; or choose a depth image aligned to colour by depth_topic="


def _example(bag: Bag, topic: Topic, colored: bool) -> tuple[Picture, tuple[int, int]]:
    """The first image that can be decoded, and its (width, height)."""
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
