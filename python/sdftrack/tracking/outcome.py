# SPDX-License-Identifier: MIT
"""What the core found of a frame, on its way to a `TrackResult`: lists and arrays with an entry per object."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.places import Place
from sdftrack.results import Status, TrackResult

__all__ = ["FOLLOWED", "doubt_overlaps", "merged", "pose_or_nan", "twists_between", "unknown_poses"]

FOLLOWED = (Status.OK, Status.WEAK)
Found = dict[str, Any]


def merged(all_objects: Found, some: Found, wanted: list[int]) -> Found:
    """What was found of all objects, with those at `wanted` replaced by `some`."""
    out = {
        key: np.array(value) if isinstance(value, np.ndarray) else list(value)
        for key, value in all_objects.items()
    }
    for i, k in enumerate(wanted):
        for key, value in out.items():
            value[k] = some[key][i]
    return out


def doubt_overlaps(found: Found, core: _core.Tracker, names: list[str]) -> None:
    """Two solids are not in one place: at most one of the two poses is right, so neither is sure."""
    sure = [k for k, s in enumerate(found["status"]) if s in FOLLOWED]
    for pair in core.overlaps(sure):
        for one, other in (pair, pair[::-1]):
            if "where another" not in found["reason"][one]:
                found["status"][one] = "weak"
                found["reason"][one] = f"it stands where another is tracked: {names[other]}"
                found["confidence"][one] *= 0.5


def unknown_poses(count: int) -> NDArray[np.float64]:
    """(count, 4, 4) NaN."""
    return np.full((count, 4, 4), np.nan)


def pose_or_nan(place: Place) -> NDArray[np.float64]:
    """(4, 4): the pose, if the place is one."""
    is_pose = isinstance(place, np.ndarray) and place.dtype == np.float64
    return np.asarray(place) if is_pose else unknown_poses(1)[0]


def twists_between(
    last: TrackResult | None,
    before: NDArray[np.float64],
    poses: NDArray[np.float64],
    status: list[Status],
    timestamp: float | None,
) -> NDArray[np.float64]:
    """(v, w) from the last poses, `before`, to these, camera axes about the object's origin."""
    if last is None or last.timestamp is None or timestamp is None or not timestamp > last.timestamp:
        return np.full((len(poses), 6), np.nan)
    twists: NDArray[np.float64] = _core.twists(before, poses, timestamp - last.timestamp)
    for k, s in enumerate(status):
        if s not in FOLLOWED or last.status[k] not in FOLLOWED:
            twists[k] = np.nan
    return twists
