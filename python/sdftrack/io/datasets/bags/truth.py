# SPDX-License-Identifier: MIT
"""True poses and models of a bag that was written from a sequence: transforms on /ground_truth, attachments."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.decoding import TRANSFORM_TYPES
from sdftrack.io.datasets.bags.transforms import pose_of

__all__ = ["TRUTH", "models_of", "true_poses"]

TRUTH = "/ground_truth"
OBJECT = re.compile(r"object_(\d+)_(\d+)")
MODEL = re.compile(r"models/obj_(\d+)\.ply")
Pose = NDArray[np.float64]


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

    files = [path] if path.is_file() else sorted(path.glob("*.mcap"))
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
        except (McapError, EOFError, ValueError):
            return []  # an interrupted recording has no index of them
