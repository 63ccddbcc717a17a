# SPDX-License-Identifier: MIT
"""Cameras, volumes and results as dictionaries of numbers, text and arrays, for the files of this package."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rigid_poses import rigid_pose
from sdftrack._internal.saved_file import array_of
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.results import Status, Steps, TrackResult
from sdftrack.sdf import SDF

__all__ = [
    "camera_from",
    "camera_record",
    "poses_of",
    "result_from",
    "result_record",
    "volume_from",
    "volume_record",
]

# Of a result of M objects: name, dtype and shape after M.
ARRAYS = {
    "poses": (4, 4), "confidence": (), "covariances": (6, 6), "twists": (6,), "inliers": (), "runner_up": (),
}  # fmt: skip
NUMBERS_PER_STEP = 5


def camera_record(camera: Camera | RGBDCamera) -> dict[str, Any]:
    """A camera, or both and their mapping."""
    if isinstance(camera, Camera):
        return dataclasses.asdict(camera)
    return {
        "depth": camera_record(camera.depth),
        "color": None if camera.color is None else camera_record(camera.color),
        "T_color_depth": camera.T_color_depth,
        "projective": camera.projective,
    }


def camera_from(record: dict[str, Any]) -> Camera | RGBDCamera:
    """The camera of a record."""
    if "depth" not in record:
        return Camera(**record)
    color = record["color"]
    projective = record["projective"]
    T = record["T_color_depth"]
    out = RGBDCamera(
        Camera(**record["depth"]),
        None if color is None else Camera(**color),
        T,
        None if projective is None else tuple(projective),
    )
    if T is not None:  # once more the nearest rotation: its last bits may differ
        object.__setattr__(out, "T_color_depth", array_of(T, "T_color_depth", np.float64, (4, 4)))
        T.setflags(write=False)
    return out


def volume_record(sdf: SDF) -> dict[str, Any]:
    """A volume, as in its own file."""
    return {"values": sdf.values, "voxel_size": sdf.voxel_size, "origin": sdf.origin, "colors": sdf.colors}


def volume_from(record: dict[str, Any]) -> SDF:
    """The volume of a record."""
    return SDF(record["values"], record["voxel_size"], record["origin"], record["colors"])


def poses_of(value: Any, name: str, count: int) -> NDArray[np.float64]:
    """(count, 4, 4) rigid transforms, or NaN; ValueError."""
    poses = array_of(value, name, np.float64, (count, 4, 4))
    for T in poses:
        if not np.isnan(T).all():
            rigid_pose(T, name)
    return poses


def result_record(result: TrackResult) -> dict[str, Any]:
    """A result with all of its fields."""
    values = {f.name: getattr(result, f.name) for f in dataclasses.fields(result)}
    steps = [np.array(list(steps), np.float64).reshape(-1, NUMBERS_PER_STEP) for steps in result.steps]
    return {**values, "steps": steps}


def result_from(record: dict[str, Any], count: int) -> TrackResult:
    """The result of a record, of `count` objects."""
    values = dict(record)
    for name, shape in ARRAYS.items():
        array_of(values[name], name, np.float64, (count, *shape))
    poses_of(values["poses"], "poses", count)
    if values["systematic"] is not None:
        array_of(values["systematic"], "systematic", np.float64, (count,))
    values["status"] = [Status(s) for s in values["status"]]
    if len(values["status"]) != count or len(values["reason"]) != count:
        raise ValueError(f"status, reason: expected {count} of each")
    values["steps"] = [
        Steps(array_of(rows, "steps", np.float64, (None, NUMBERS_PER_STEP))) for rows in values["steps"]
    ]
    return TrackResult(**values)
