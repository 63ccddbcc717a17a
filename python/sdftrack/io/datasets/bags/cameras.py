# SPDX-License-Identifier: MIT
"""The camera of an image topic, by the CameraInfo or CameraCalibration that belongs to it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from sdftrack.camera import Camera
from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.decoding import INFO_TYPES, Info
from sdftrack.io.datasets.bags.topics import same_image

__all__ = ["camera_of", "find_camera"]


def find_camera(bag: Bag, topic: str, frame_id: str, size: tuple[int, int]) -> tuple[Camera | None, str]:
    """The camera of a topic whose images have `frame_id` and `size` (width, height), and the topic it is from.

    First the topic beside the images, by ROS' convention; else the only one with the same frame and size, or the
    only one of that frame. None and the topics there are, if there is none.
    """
    infos = {
        t.name: info for t in bag.topics.values() if t.type in INFO_TYPES and (info := _first(bag, t.name))
    }
    image = same_image(topic)
    space = image.rpartition("/")[0]
    beside = [n for n in (f"{space}/camera_info", f"{image}/camera_info") if n in infos]
    beside = beside or [n for n in infos if n.rpartition("/")[0] == space]
    in_frame = [n for n, info in infos.items() if frame_id and info.frame_id == frame_id]
    in_size = [n for n in in_frame if (infos[n].message.width, infos[n].message.height) == size]
    for found in (
        beside[:1] if len(beside) == 1 or f"{space}/camera_info" in beside else [],
        in_size,
        in_frame,
    ):
        if found and (len(found) == 1 or len({str(camera_of(infos[n], image)) for n in found}) == 1):
            return _named_camera(bag, infos[found[0]], image, found[0]), found[0]
    return None, ", ".join(infos) or "none"


def camera_of(info: Info, image: str) -> Camera:
    """The camera of the images: K and D, or for rectified images the pinhole in P.

    ValueError for a lens other than plumb_bob and rational_polynomial, and for a part of an image.
    """
    message = info.message
    if image.rpartition("/")[2].startswith("image_rect"):
        P = np.asarray(message.P if hasattr(message, "P") else message.p, dtype=float)
        if P.size == 12 and P[0] > 0:
            K = P.reshape(3, 4)[:, :3].ravel()
            rest = {
                name: getattr(message, name)
                for name in ("roi", "binning_x", "binning_y")
                if hasattr(message, name)
            }
            message = SimpleNamespace(
                width=message.width, height=message.height, distortion_model="plumb_bob", d=(), k=K, **rest
            )
    return Camera.from_ros(message)


def _named_camera(bag: Bag, info: Info, image: str, topic: str) -> Camera:
    try:
        return camera_of(info, image)
    except ValueError as error:
        raise ValueError(f"{bag.path}, {topic}: {error}") from None


def _first(bag: Bag, topic: str) -> Info | None:
    messages = bag.messages(topic)
    for i in range(min(5, len(messages))):
        try:
            info: Info = messages[i]
        except ValueError:
            continue
        return info
    return None
