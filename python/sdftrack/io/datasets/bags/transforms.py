# SPDX-License-Identifier: MIT
"""Poses in a recording: fixed transforms between its frames, and the true poses and models of a bag that was written
from a sequence (transforms on /ground_truth, attachments).
"""

from __future__ import annotations

import re
import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.natural_order import in_order
from sdftrack._internal.rotations import rotation
from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.decoding import TRANSFORM_TYPES, Transform

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
    """T_parent_child; None if its numbers are none."""
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
        i = number.get(int(time))
        if i is None:
            continue
        transforms: list[Any] = messages[n]
        for t in transforms:
            named, T = OBJECT.fullmatch(t.child), pose_of(t)
            if named is not None and T is not None:
                k = int(named[1])
                objects[k] = int(named[2])
                poses.setdefault(i, {})[k] = T
    return [objects.get(k, 1) for k in range(1 + max(objects, default=-1))], poses


def models_of(path: Path) -> dict[int, Any]:
    """{obj_id: Mesh} of the attachments of an .mcap file, or of those in a folder; {} without any."""
    from sdftrack.mesh import Mesh

    files = [path] if path.is_file() else in_order(path.glob("*.mcap"))
    models: dict[int, Any] = {}
    for file in files:
        for name, data in _attachments(file):
            found = MODEL.fullmatch(name)
            if found is not None:
                with tempfile.TemporaryDirectory() as folder:
                    mesh = Path(folder, "model.ply")
                    mesh.write_bytes(data)
                    models[int(found[1])] = Mesh.load(mesh, unit="m")
    return models


def _attachments(path: Path) -> list[tuple[str, bytes]]:
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    with path.open("rb") as file:
        try:
            return [(a.name, a.data) for a in make_reader(file).iter_attachments()]
        except (McapError, EOFError, ValueError, struct.error):
            return []  # an interrupted recording has no index of them
