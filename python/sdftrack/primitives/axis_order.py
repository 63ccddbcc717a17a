# SPDX-License-Identifier: MIT
"""One order for the axes of a solid that has three of its own: a box, an ellipsoid."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["descending"]


def descending(answer: dict[str, Any]) -> dict[str, Any]:
    """The core's answer with its axes renamed: x along the longest length, z along the shortest.

    Of the four turns that give the same solid, the one whose z points towards the camera and whose x points to the
    right of the image. Pose covariances are in camera axes and do not change.
    """
    size = np.asarray(answer["size"])
    order = np.argsort(-size, kind="stable")
    T = np.array(answer["T_cam_obj"])
    x, z = T[:3, order[0]], T[:3, order[2]]
    x, z = x if x[0] >= 0 else -x, z if z[2] <= 0 else -z
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    rows = np.concatenate([np.arange(6), 6 + order])
    renamed = {name: [answer[name][i] for i in order] for name in ("size", "bounded", "far")}
    covariance = np.asarray(answer["covariance"])[np.ix_(rows, rows)]
    return {**answer, **renamed, "T_cam_obj": T, "covariance": covariance}
