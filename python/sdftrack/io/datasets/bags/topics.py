# SPDX-License-Identifier: MIT
"""What belongs together in a bag: topics of depth and colour (the only ones that fit, or those that are named), their
cameras, fixed transforms between its frames, and the true poses and models of a bag written from a sequence."""

from __future__ import annotations

import contextlib
import re
import struct
import tempfile
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import rotation
from sdftrack._internal.text_files import in_order, named
from sdftrack.camera import Camera
from sdftrack.io.datasets.bags.bag import Bag, Topic
from sdftrack.io.datasets.bags.decoding import IMAGE_TYPES, INFO_TYPES, TRANSFORM_TYPES, Info, Transform
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
        topics = _listed(t for t in bag.topics.values() if t.count)
        raise ValueError(
            f"{bag.path}: the recording has no depth images, which the trackers require; its topics: {topics}"
        )
    if len(found) > 1:
        several = f"{bag.path} has several topics with depth images"
        raise ValueError(f"depth_topic: {several}; choose one of: {_listed(found)}")
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
        several = f"{bag.path} has several topics with colour images"
        raise ValueError(f'color_topic: {several}; choose one, or "none", of: {_listed(found)}')
    return found[0] if found else None


def _named(bag: Bag, wanted: str, fitting: list[Topic], option: str, what: str) -> Topic:
    for name in (wanted, f"/{wanted}"):
        topic = bag.topics.get(name)
        if topic is not None and topic.type in IMAGE_TYPES and topic.count:
            return topic
    expected = f"expected a topic of {bag.path} with {what}"
    raise ValueError(f"{option}: {expected}, got {wanted!r}; those that fit: {_listed(fitting)}")


def _plain(topics: list[Topic]) -> list[Topic]:
    by_image: dict[str, Topic] = {}
    for topic in sorted(topics, key=lambda t: same_image(t.name) != t.name):
        if not INFRARED.search(topic.name):
            by_image.setdefault(same_image(topic.name), topic)
    return sorted(by_image.values(), key=lambda t: t.name)


def _listed(topics: Iterable[Topic]) -> str:
    return (
        " ".join(", ".join(map(str, topics)).split()) or "none"
    )  # in one line, also those of a damaged file


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
    sure = beside[:1] if len(beside) == 1 or f"{space}/camera_info" in beside else []
    in_frame = [n for n, info in infos.items() if frame_id and info.frame_id == frame_id]
    in_size = [n for n in in_frame if (infos[n].message.width, infos[n].message.height) == size]
    for found in (sure, in_size, in_frame):
        if found and (len(found) == 1 or len({str(camera_of(infos[n], image)) for n in found}) == 1):
            with named(f"{bag.path}, {found[0]}"):
                return camera_of(infos[found[0]], image), found[0]
    return None, ", ".join(infos) or "none"


def camera_of(info: Info, image: str) -> Camera:
    """The camera of the images: K and D, or for rectified images the pinhole in P. ValueError for a lens other than
    plumb_bob and rational_polynomial, and for a part of an image."""
    message = info.message
    if image.rpartition("/")[2].startswith("image_rect"):
        P = np.asarray(message.P if hasattr(message, "P") else message.p, dtype=float)
        if P.size == 12 and P[0] > 0:
            names = ("width", "height", "roi", "binning_x", "binning_y")
            rest = {name: getattr(message, name) for name in names if hasattr(message, name)}
            K = P.reshape(3, 4)[:, :3].ravel()
            message = SimpleNamespace(distortion_model="plumb_bob", d=(), k=K, **rest)
    return Camera.from_ros(message)


MAX_MESSAGES = 200  # of a topic whose transforms may move
SAME = 1e-6  # metres, and entries of a rotation matrix
Pose = NDArray[np.float64]
TRUTH = "/ground_truth"
OBJECT = re.compile(r"object_(\d+)_(\d+)")
MODEL = re.compile(r"models/obj_(\d+)\.ply")


def fixed_transforms(bag: Bag) -> dict[tuple[str, str], Pose]:
    """{(parent, child): T_parent_child} of transforms that are the same in all messages looked at."""
    fixed: dict[tuple[str, str], Pose] = {}
    moving: set[tuple[str, str]] = set()
    for topic in bag.topics.values():
        if topic.type not in TRANSFORM_TYPES:
            continue
        for transforms in bag.messages(topic.name).first(MAX_MESSAGES):
            for t in transforms:
                pose, edge = pose_of(t), (t.parent, t.child)
                if pose is None or np.abs(fixed.setdefault(edge, pose) - pose).max() > SAME:
                    moving.add(edge)
    return {edge: pose for edge, pose in fixed.items() if edge not in moving}


def transform_between(fixed: dict[tuple[str, str], Pose], to: str, start: str) -> Pose | None:
    """T_to_start along fixed transforms; None if they do not connect the two frames."""
    found = {start: np.eye(4)}  # {frame: T_frame_start}
    todo = [start]
    while todo:
        frame = todo.pop(0)
        for (parent, child), T_parent_child in fixed.items():
            if child == frame and parent not in found:
                found[parent] = T_parent_child @ found[frame]
                todo.append(parent)
            elif parent == frame and child not in found:
                found[child] = np.linalg.inv(T_parent_child) @ found[frame]
                todo.append(child)
    return found.get(to)


def pose_of(t: Transform) -> Pose | None:
    q = np.asarray(t.rotation, np.float64)
    if not (np.isfinite(q).all() and q @ q > 1e-6 and np.isfinite(t.translation).all()):
        return None
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(q), t.translation
    return T


def true_poses(bag: Bag, depth_topic: str) -> tuple[list[int], dict[int, dict[int, Pose]]]:
    """obj_id of each instance k, and {i: {k: T_cam_obj}} where poses were recorded with the i-th depth image."""
    topic = bag.topics.get(TRUTH)
    if topic is None or topic.type not in TRANSFORM_TYPES:
        return [], {}
    number = {int(time): i for i, time in enumerate(bag.messages(depth_topic).recorded_ns())}
    messages = bag.messages(TRUTH)
    objects: dict[int, int] = {}
    poses: dict[int, dict[int, Pose]] = {}
    for n, time in enumerate(messages.recorded_ns()):
        if int(time) not in number:
            continue
        for t in messages[n]:
            named, T = OBJECT.fullmatch(t.child), pose_of(t)
            if named is not None and T is not None:
                objects[int(named[1])] = int(named[2])
                poses.setdefault(number[int(time)], {})[int(named[1])] = T
    return [objects.get(k, 1) for k in range(1 + max(objects, default=-1))], poses


def models_of(path: Path) -> dict[int, Any]:
    """{obj_id: Mesh} of the attachments of an .mcap file, or of those in a folder; {} without any."""
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    from sdftrack.mesh import Mesh

    attached: dict[str, bytes] = {}
    for file in [path] if path.is_file() else in_order(path.glob("*.mcap")):
        # An interrupted recording has no index of them.
        with file.open("rb") as opened, contextlib.suppress(McapError, EOFError, ValueError, struct.error):
            attached |= {a.name: a.data for a in make_reader(opened).iter_attachments()}
    models: dict[int, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, data in attached.items():
            if found := MODEL.fullmatch(name):
                mesh = Path(folder, "model.ply")
                mesh.write_bytes(data)
                models[int(found[1])] = Mesh.load(mesh, unit="m")
    return models
