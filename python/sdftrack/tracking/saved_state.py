# SPDX-License-Identifier: MIT
"""A tracker's state as nested dictionaries of numbers, text and arrays, for its file."""

from __future__ import annotations

from typing import Any

from sdftrack._internal.saved_file import FileKind
from sdftrack.options import TrackerOptions
from sdftrack.primitives.tracked import FreeSizes
from sdftrack.results import TrackResult
from sdftrack.sensor import SensorModel
from sdftrack.symmetry import Symmetry
from sdftrack.tracking.saved_records import (
    camera_from,
    camera_record,
    poses_of,
    result_from,
    result_record,
    volume_from,
    volume_record,
)

__all__ = ["KIND", "content_of", "state_from"]

KIND = FileKind("sdftrack.Tracker", 1, "Tracker.save")


def content_of(state: dict[str, Any]) -> dict[str, Any]:
    """Content of a file, from ``Tracker.__getstate__``."""
    arguments = dict(state["arguments"])
    index, last, best, free_sizes = state["progress"]
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
        "index": index,
        "last": None if last is None else result_record(last),
        "best": best,
        "sizes": free_sizes.record(),
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
    last: TrackResult | None = None if content["last"] is None else result_from(content["last"], count)
    best = poses_of(content["best"], "best", count)
    progress = (int(content["index"]), last, best, FreeSizes.from_record(content["sizes"], count))
    return {
        "shapes": shapes, "camera": camera_from(content["camera"]), "arguments": arguments, "progress": progress,
    }  # fmt: skip


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
