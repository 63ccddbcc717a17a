# SPDX-License-Identifier: MIT
"""Where the object can be by the first frame, point by point: the twin of cpp/reconstruction/first_view.h."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera

Array = NDArray[Any]
BEND = 0.1  # of a plane, over the distance from the object


def may_hold(
    point_obj: Array,
    camera: Camera,
    T_cam_obj: Array,
    from_m: Array,
    planes: Array,
    middle: Array,
    radius_m: float,
) -> bool:
    """Above all planes, and not nearer than what the first frame leaves on the point's ray."""
    p = T_cam_obj[:3, :3] @ point_obj + T_cam_obj[:3, 3]
    away = max(0.0, float(np.linalg.norm(p - middle)) - radius_m)
    for plane in planes:
        if plane[:3] @ p + plane[3] < plane[4] + BEND * away:
            return False
    if p[2] <= 0:
        return False
    x, y = np.floor(camera.project(p) + 0.5)
    column, row = int(np.clip(x, 0, camera.width - 1)), int(np.clip(y, 0, camera.height - 1))
    return bool(p[2] >= from_m[row, column])
