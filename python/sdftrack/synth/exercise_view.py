# SPDX-License-Identifier: MIT
"""Where a camera stands that looks down at a table, and whether it sees all of an exercise."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack.camera import Camera
from sdftrack.synth.exercise_motion import ObjectMotion

__all__ = ["CAMERA", "in_view", "random_view"]

Array = NDArray[np.float64]
CAMERA = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
DISTANCE_M = (0.6, 0.9)  # along the optical axis
DOWN_RAD = (float(np.radians(38)), float(np.radians(60)))
ROLL_RAD = float(np.radians(4))
RATE_HZ = 25.0  # at which visibility is checked
# A ball that holds each of the objects, and how far its middle is above the foot.
BALL_M, MIDDLE_M = 0.09, 0.06


def random_view(rng: np.random.Generator) -> Array:
    """T_cam_table of a camera whose optical axis meets the table in the table's origin."""
    down, roll = rng.uniform(*DOWN_RAD), rng.uniform(-ROLL_RAD, ROLL_RAD)
    x, up = np.array([1.0, 0, 0]), np.array([0, -np.cos(down), -np.sin(down)])
    T = np.eye(4)
    T[:3, :3] = geometry.pose([0, 0, roll])[:3, :3] @ np.column_stack([x, np.cross(up, x), up])
    T[2, 3] = rng.uniform(*DISTANCE_M)
    return T


def in_view(T_cam_table: Array, motions: Iterable[ObjectMotion], duration_s: float, origin_m: float) -> bool:
    """Whether a hand-sized object stays inside the image."""
    times = np.arange(0, duration_s, 1 / RATE_HZ)
    for motion in motions:
        middle = motion.places(times)[0] + (MIDDLE_M - origin_m) * motion.rotations(times)[0][:, :, 2]
        p = geometry.transform_points(T_cam_table, middle)
        # To first order; the outline of a ball away from the axis is a little longer.
        reach = 1.1 * BALL_M / p[:, 2]
        for axis, focal, centre, size in (
            (0, CAMERA.fx, CAMERA.cx, CAMERA.width), (1, CAMERA.fy, CAMERA.cy, CAMERA.height),
        ):  # fmt: skip
            px = focal * p[:, axis] / p[:, 2] + centre
            if (px - focal * reach).min() < 0 or (px + focal * reach).max() > size - 1:
                return False
    return True
