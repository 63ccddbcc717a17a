# SPDX-License-Identifier: MIT
"""What an occluder knows about the scene in which it acts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.synth.bodies import Body
from sdftrack.synth.surroundings import Layer

__all__ = ["SKIN", "Occluder", "Stage"]

SKIN = (205, 155, 130)


@dataclass(frozen=True)
class Stage:
    """The first object, its poses (n, 4, 4) T_cam_obj, the camera, the seed and the frames per second."""

    body: Body
    poses: NDArray[np.float64]
    camera: Camera
    seed: int
    fps: float


class Occluder(Protocol):
    """Something in front of the first object.

    `ready` is called once and returns a function (frame, visible, depth) -> layer, with the (H, W) pixels in
    which the object would be seen and the depth image without the occluder. The layer of a frame depends on
    nothing but these and the frame's number: frames are rendered in any order.
    """

    def ready(self, stage: Stage) -> Callable[[int, NDArray[np.bool_], NDArray[np.float32]], Layer | Any]: ...
