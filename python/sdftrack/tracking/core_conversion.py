# SPDX-License-Identifier: MIT
"""Conversion of frames, volumes and colours to the core's types, and of its results to ours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.frame import Frame
from sdftrack.results import Status, Steps, TrackResult
from sdftrack.sensor import SensorModel


def core_frame(
    frame: Frame,
    color: NDArray[np.uint8] | None,
    color_map: Any,
    with_depth: bool = True,
    sensor: SensorModel | None = None,
) -> _core.TrackerFrame:
    """Convert a frame: subtract the sensor's bias; add the colour image to use, if any, and its mapping."""
    depth, given = (frame.depth, frame._given) if with_depth else (None, None)
    if depth is not None and sensor is not None:
        depth = sensor.corrected(depth)
        given = None if given is None else sensor.corrected(given)
    mask = None if frame.mask is None else np.ascontiguousarray(frame.mask).view(np.uint8)
    time_s = float("nan") if frame.timestamp is None else float(frame.timestamp)
    return _core.TrackerFrame(depth, mask, color, color_map, time_s, frame.error or "", given)


def rgb_seen(rgba: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """A shape's colours in the core's form: each times 256, followed by the observation weight."""
    out = rgba.astype(np.uint16) * np.uint16(256)
    known = rgba[..., 3] > 0
    out[..., 3] = np.where(known, 65535, 0)
    black = known & ~rgba[..., :3].any(axis=-1)
    out[black, 2] = 1  # 0, 0, 0 stands for an unknown colour
    return out


# -- Builds a `TrackResult` from the core's result of a frame: arrays and lists with one entry per object


STATUS = {s.value: s for s in Status}


def assembled(found: dict[str, Any], **of_frame: Any) -> TrackResult:
    """Wrap `found`, with the further fields of a `TrackResult`; all decisions about a frame are made in the core."""
    steps = [Steps(trials) for trials in found["steps"]]
    status, energy = [STATUS[s] for s in found["status"]], float(found["energy"].mean())
    iterations = sum(map(len, steps))
    return TrackResult(
        **{**found, "status": status, "energy": energy, "steps": steps}, iterations=iterations, **of_frame
    )
