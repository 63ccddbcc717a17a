# SPDX-License-Identifier: MIT
"""Records: the state of an energy, its linearisation, and its minimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.rotations import RotationErrors, rigid_pose
from sdftrack._internal.validation import numbers, of_kind
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.results import Step

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class State:
    """A point in the space of unknowns.

    Attributes
    ----------
    poses : (M, 4, 4) float64
        ``T_cam_obj``, m.
    camera : Camera, optional
        Camera whose fx, fy, cx, cy are unknowns with ``"intrinsics"``; None: the energy's own.
    scales : (M,) float64, optional
        Scale relative to the shape, with ``"scale"``; None: 1.
    """

    poses: Array
    camera: Camera | None = None
    scales: Array | None = None


@dataclass(frozen=True, eq=False)
class Linearization:
    """The quadratic model of an energy: order of unknowns (vx, vy, vz, wx, wy, wz [, log scale | fx, fy, cx, cy]).

    Unknowns are increments of ``T_obj_cam`` about the centre of the object's box, v in m and w in rad.
    """

    cost: float
    gradient: Array
    hessian: Array
    count: int


@dataclass(frozen=True, eq=False)
class Minimum:
    """Result of :func:`minimize`: final state, all steps, and stopping reason."""

    x: State
    steps: list[Step]
    stop: str
    cost: float
    count: int


def depth_and_mask(frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.uint8] | None]:
    """The depth image and the mask of a frame, for the core."""
    of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
    if frame.depth is None:
        raise ValueError("frame: expected a depth image, got none")
    return frame.depth, None if frame.mask is None else np.ascontiguousarray(frame.mask).view(np.uint8)


def state_poses(poses: ArrayLike, count: int) -> Array:
    """Validate (count, 4, 4) rigid poses."""
    T = numbers(poses, "poses")
    T = T[None] if T.ndim == 2 else T
    if T.ndim != 3 or len(T) != count:
        raise ValueError(
            f"poses: expected one 4x4 matrix per shape ({count}), got an array of shape {T.shape}"
        )
    errors = RotationErrors()
    rigid = np.stack([rigid_pose(np.ascontiguousarray(each), "poses", errors) for each in T])
    errors.tell()
    return rigid
