# SPDX-License-Identifier: MIT
"""What hangs together in a depth image (in the core)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import depth_camera

Mask = NDArray[np.bool_]


def connected_region(frame: Any, camera: Any, px: tuple[float, float], reach_m: float) -> Mask:
    """Pixels connected to `px` without a depth discontinuity, within `reach_m`, and not on the dominant plane.

    `px` (x, y) are depth pixels, `reach_m` is the object's diameter. ValueError without depth at or near `px`, or with
    almost no connected pixels there.
    """
    lens = depth_camera(camera)
    if frame.depth is None:
        raise ValueError(f"expected a depth image, got none{': ' + frame.error if frame.error else ''}")
    rays = lens.rays if lens.distortion else None
    return _core.connected_region(frame.depth, lens._core, rays, px, reach_m)
