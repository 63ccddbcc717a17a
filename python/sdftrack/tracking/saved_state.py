# SPDX-License-Identifier: MIT
"""A tracker's state, and that of cameras and volumes, as dictionaries of numbers, text and arrays, for files."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.saved_file import FileKind, array_of
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.options import TrackerOptions
from sdftrack.primitives.tracked import FreeSizes
from sdftrack.results import Status, Steps, TrackResult
from sdftrack.sdf import SDF
from sdftrack.sensor import SensorModel
from sdftrack.symmetry import Symmetry

KIND = FileKind("sdftrack.Tracker", 6, "Tracker.save")
# Of a result of M objects: name, dtype and shape after M.
ARRAYS = {
    "poses": (4, 4), "confidence": (), "covariances": (6, 6), "twists": (6,), "inliers": (), "runner_up": (),
}  # fmt: skip
NUMBERS_PER_STEP = 5


def content_of(state: dict[str, Any]) -> dict[str, Any]:
    """Content of a file, from ``Tracker.__getstate__``."""
    arguments = dict(state["arguments"])
    progress = state["progress"]
    volumes = list({id(shape): shape for shape in state["shapes"]}.values())
    places = {id(volume): i for i, volume in enumerate(volumes)}
    sensor = arguments["sensor"]
    arguments["options"] = arguments["options"].to_dict()
    arguments["sensor"] = None if sensor is None else sensor.to_dict()
    arguments["symmetry"] = [None if s is None else _symmetry_record(s) for s in arguments["symmetry"]]
    return {
        "volumes": [volume_record(volume) for volume in volumes],
        "shapes": [places[id(shape)] for shape in state["shapes"]],
        "camera": camera_record(state["camera"]),
        "arguments": arguments,
        **progress,
        "last": None if progress["last"] is None else _result_record(progress["last"]),
        "sizes": progress["sizes"].record(),
        "frame_camera": camera_record(progress["frame_camera"]),
    }


def state_from(content: dict[str, Any]) -> dict[str, Any]:
    """What ``Tracker.__setstate__`` takes, from the content of a file; any error of a wrong value is possible."""
    volumes = [volume_from(record) for record in content["volumes"]]
    shapes = [volumes[i] for i in content["shapes"]]
    arguments = dict(content["arguments"])
    sensor = arguments["sensor"]
    arguments["options"] = TrackerOptions.from_dict(arguments["options"])
    arguments["sensor"] = None if sensor is None else SensorModel.from_dict(sensor)
    arguments["symmetry"] = [None if s is None else _symmetry_from(s) for s in arguments["symmetry"]]
    count = len(shapes)
    last: TrackResult | None = None if content["last"] is None else _result_from(content["last"], count)
    best = _poses_of(content["best"], "best", count)
    camera = camera_from(content["camera"])
    sizes = FreeSizes.from_record(content["sizes"], count)
    if "core" in content:
        modes, frame_camera = [str(mode) for mode in content["modes"]], Camera(**content["frame_camera"])
    else:  # version 1
        modes, frame_camera = ["depth"] * count, depth_camera(camera)
    if len(modes) != count:
        raise ValueError(f"modes: expected {count}")
    progress = {
        "core": content.get("core", b""), "index": int(content["index"]), "last": last, "best": best, "sizes": sizes,
        "frame_camera": frame_camera, "modes": modes,
    }  # fmt: skip
    return {"shapes": shapes, "camera": camera, "arguments": arguments, "progress": progress}


def _symmetry_record(symmetry: Symmetry) -> dict[str, Any]:
    axes = [[axis, point] for axis, point in symmetry.continuous]
    return {"discrete": symmetry.discrete, "continuous": axes}


def _symmetry_from(record: dict[str, Any]) -> Symmetry:
    discrete, axes = record["discrete"], tuple((axis, point) for axis, point in record["continuous"])
    out = Symmetry(discrete, axes)
    # Checked, and with the same bits: the constructor normalises what was normalised already.
    object.__setattr__(out, "discrete", discrete)
    object.__setattr__(out, "continuous", axes)
    return out


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


def _poses_of(value: Any, name: str, count: int) -> NDArray[np.float64]:
    """(count, 4, 4) rigid transforms, or NaN; ValueError."""
    poses = array_of(value, name, np.float64, (count, 4, 4))
    for T in poses:
        if not np.isnan(T).all():
            rigid_pose(T, name)
    return poses


def _result_record(result: TrackResult) -> dict[str, Any]:
    """A result with all of its fields."""
    values = {f.name: getattr(result, f.name) for f in dataclasses.fields(result)}
    steps = [np.array(list(steps), np.float64).reshape(-1, NUMBERS_PER_STEP) for steps in result.steps]
    return {**values, "steps": steps}


def _result_from(record: dict[str, Any], count: int) -> TrackResult:
    """The result of a record, of `count` objects."""
    values = dict(record)
    for name, shape in ARRAYS.items():
        array_of(values[name], name, np.float64, (count, *shape))
    _poses_of(values["poses"], "poses", count)
    if values["systematic"] is not None:
        array_of(values["systematic"], "systematic", np.float64, (count,))
    if values.get("unstated") is not None:
        array_of(values["unstated"], "unstated", np.float64, (count, 6, 6))
    values["status"] = [Status(s) for s in values["status"]]
    if len(values["status"]) != count or len(values["reason"]) != count:
        raise ValueError(f"status, reason: expected {count} of each")
    values["steps"] = [
        Steps(array_of(rows, "steps", np.float64, (None, NUMBERS_PER_STEP))) for rows in values["steps"]
    ]
    return TrackResult(**values)
