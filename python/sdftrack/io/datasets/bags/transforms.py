# SPDX-License-Identifier: MIT
"""The fixed transforms between the frames of a recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import rotation
from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.decoding import TRANSFORM_TYPES, Transform

__all__ = ["fixed_transforms", "pose_of", "transform_between"]

MAX_MESSAGES = 200  # of a topic whose transforms may move
SAME = 1e-6  # metres, and entries of a rotation matrix
Pose = NDArray[np.float64]


def fixed_transforms(bag: Bag) -> dict[tuple[str, str], Pose]:
    """{(parent, child): T_parent_child} of transforms that are the same in all messages looked at."""
    fixed: dict[tuple[str, str], Pose] = {}
    moving: set[tuple[str, str]] = set()
    for topic in bag.topics.values():
        if topic.type not in TRANSFORM_TYPES:
            continue
        messages = bag.messages(topic.name)
        for i in range(min(MAX_MESSAGES, len(messages))):
            try:
                transforms: list[Transform] = messages[i]
            except ValueError:
                continue  # not whole
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
