# SPDX-License-Identifier: MIT
"""One frame's result as plain values: what every kind of stream sends, without a network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.quaternions import quaternion
from sdftrack.camera import Camera
from sdftrack.io.result_rows import object_entry, plain
from sdftrack.live.streams.kinds import Packet
from sdftrack.results import Status, TrackResult

__all__ = ["VERSION", "frame_message", "name_of", "position_and_quaternion", "ros_covariance", "tracked"]

VERSION = 1  # of the JSON messages, docs/reference/stream.schema.json
UNKNOWN_VARIANCE = 1e6  # m^2 and rad^2: filters that read ROS messages take it as "says nothing"
_KEPT = ("name", "status", "reason", "confidence")
Array = NDArray[np.float64]


def frame_message(packet: Packet, names: Sequence[str], camera: Camera) -> dict[str, Any]:
    """The message of docs/reference/stream.schema.json: metres, radians, seconds, None where unknown, never NaN."""
    result = packet.result
    return {
        "version": VERSION,
        "index": packet.index,
        "timestamp": plain(packet.timestamp),
        "sent": packet.sent,
        "camera": {key: getattr(camera, key) for key in ("width", "height", "fx", "fy", "cx", "cy")},
        "objects": [_object(packet, k, name_of(names, k)) for k in range(len(result.poses))],
    }


def _object(packet: Packet, k: int, name: str) -> dict[str, Any]:
    result = packet.result
    entry = object_entry(result, k, k + 1, name)
    pose = None
    if entry["pose"] is not None:
        position, rotation = position_and_quaternion(result.poses[k])
        pose = {"position": position, "quaternion": rotation}
    twist = result.twists[k]
    motion = {"motion": dict(packet.motion[k])} if packet.motion is not None else {}
    return {
        **{key: entry[key] for key in _KEPT},
        "pose": pose,
        "covariance": entry["covariance"],
        "twist": plain(twist) if np.isfinite(twist).all() else None,
        **motion,
    }


def position_and_quaternion(T: Array) -> tuple[list[float], list[float]]:
    """(x, y, z) in metres and (x, y, z, w) with w >= 0 of T_cam_obj (4, 4)."""
    return T[:3, 3].tolist(), quaternion(T[:3, :3]).tolist()


def ros_covariance(covariance: Array) -> Array:
    """(36,) row by row of a covariance (6, 6) of a result, whose order and axes are ROS's.

    Of (x, y, z, rotations about x, y, z) in the axes of the message's frame. Without one, each variable has
    `UNKNOWN_VARIANCE`: ROS reads zeros as certain.
    """
    known: Array = covariance if np.isfinite(covariance).all() else UNKNOWN_VARIANCE * np.eye(6)
    return known.reshape(36)


def tracked(result: TrackResult, k: int) -> bool:
    """Whether object k has a pose from this frame."""
    return result.status[k] in (Status.OK, Status.WEAK) and bool(np.isfinite(result.poses[k]).all())


def name_of(names: Sequence[str], k: int) -> str:
    """Name of object k, also of one added after the stream was opened."""
    return names[k] if k < len(names) else f"object_{k}"
