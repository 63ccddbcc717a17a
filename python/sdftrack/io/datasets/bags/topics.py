# SPDX-License-Identifier: MIT
"""Which topics hold the depth and the colour images: the only ones that fit, or those that are named; their cameras."""

from __future__ import annotations

import re
from collections.abc import Iterable
from types import SimpleNamespace

import numpy as np

from sdftrack._internal.text_files import named
from sdftrack.camera import Camera
from sdftrack.io.datasets.bags.bag import Bag, Topic
from sdftrack.io.datasets.bags.decoding import IMAGE_TYPES, INFO_TYPES, Info
from sdftrack.io.datasets.bags.pictures import DEPTH_ENCODINGS, encoding_of

# Images of infrared cameras have the encodings of depth or grey images; only their names tell.
INFRARED = re.compile(r"(^|[/_])(ir|infra\w*|confidence|amplitude)\d?([/_]|$)", re.IGNORECASE)
TRANSPORTS = ("compressed", "compresseddepth", "rvl", "zstd")
LOOKED_AT = 5  # messages at the beginning of a topic
NONE = "none"


def same_image(topic: str) -> str:
    """The topic without the name of a transport: /a/image/compressed holds the images of /a/image."""
    start, _, last = topic.rpartition("/")
    return start if start and last.lower() in TRANSPORTS else topic


def kind_of(bag: Bag, topic: Topic) -> str:
    """ "depth", "color", or "" for a topic that holds neither; by its first messages."""
    if topic.type not in IMAGE_TYPES or not topic.count:
        return ""
    for picture in bag.messages(topic.name).first(LOOKED_AT):
        encoding = encoding_of(picture)
        if encoding not in DEPTH_ENCODINGS:
            return "color"
        # Infrared images are often mono16, so for that encoding the name must say "depth".
        return "depth" if encoding != "mono16" or "depth" in topic.name.lower() else ""
    return ""


def choose_depth(bag: Bag, wanted: str | None) -> Topic:
    """ValueError with the topics that fit, if it is not certain."""
    fitting = [t for t in bag.topics.values() if kind_of(bag, t) == "depth"]
    if wanted is not None:
        return _named(bag, wanted, fitting, "depth_topic", "depth images")
    found = _plain(fitting)
    if not found:
        topics = _listed(t for t in bag.topics.values() if t.count) or "none"
        raise ValueError(
            f"{bag.path}: the recording has no depth images, which the trackers require; its topics: {topics}"
        )
    if len(found) > 1:
        raise ValueError(
            f"depth_topic: {bag.path} has several topics with depth images; choose one of: {_listed(found)}"
        )
    return found[0]


def choose_color(bag: Bag, wanted: str | None, depth: Topic) -> Topic | None:
    """None without colour, or for "none"; ValueError as for depth."""
    if wanted == NONE:
        return None
    fitting = [t for t in bag.topics.values() if kind_of(bag, t) == "color" and t != depth]
    if wanted is not None:
        return _named(bag, wanted, fitting, "color_topic", "colour images")
    found = _plain(fitting)
    if len(found) > 1:
        raise ValueError(
            f'color_topic: {bag.path} has several topics with colour images; choose one, or "none", of: '
            f"{_listed(found)}"
        )
    return found[0] if found else None


def _named(bag: Bag, wanted: str, fitting: list[Topic], option: str, what: str) -> Topic:
    for name in (wanted, f"/{wanted}"):
        topic = bag.topics.get(name)
        if topic is not None and topic.type in IMAGE_TYPES and topic.count:
            return topic
    raise ValueError(
        f"{option}: expected a topic of {bag.path} with {what}, got {wanted!r}; those that fit: "
        f"{_listed(fitting) or 'none'}"
    )


def _plain(topics: list[Topic]) -> list[Topic]:
    """Without infrared images, and of several transports of the same images the raw one."""
    by_image: dict[str, Topic] = {}
    for topic in sorted(topics, key=lambda t: same_image(t.name) != t.name):
        if not INFRARED.search(topic.name):
            by_image.setdefault(same_image(topic.name), topic)
    return sorted(by_image.values(), key=lambda t: t.name)


def _listed(topics: Iterable[Topic]) -> str:
    return " ".join(", ".join(map(str, topics)).split())  # in one line, also those of a damaged file


def find_camera(bag: Bag, topic: str, frame_id: str, size: tuple[int, int]) -> tuple[Camera | None, str]:
    """The camera of a topic whose images have `frame_id` and `size` (width, height), and the topic it is from.

    First the topic beside the images, by ROS' convention; else the only one with the same frame and size, or the
    only one of that frame. None and the topics there are, if there is none.
    """
    infos: dict[str, Info] = {
        t.name: info
        for t in bag.topics.values()
        if t.type in INFO_TYPES and (info := next(bag.messages(t.name).first(LOOKED_AT), None))
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
            with named(f"{bag.path}, {found[0]}"):
                return camera_of(infos[found[0]], image), found[0]
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
