# SPDX-License-Identifier: MIT
"""Colours of depth pixels: which colour pixel belongs to which depth pixel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera, RGBDCamera, depth_camera


def color_map(camera: Camera | RGBDCamera, color: NDArray[np.uint8]) -> Any:
    """The core's mapping from depth pixels to the pixels of `color`, (h, w, 3).

    A Camera, or an RGBDCamera without a mapping, means that colour is aligned to depth. ValueError if `color` does not
    have the size of the camera (for aligned colour: of the depth image).
    """
    depth, size = depth_camera(camera), color.shape[:2]
    rig = camera if isinstance(camera, RGBDCamera) and not camera.aligned else None
    if rig is None:
        if size != depth.shape:
            raise ValueError(
                f"color: expected the size of the depth image, {depth.width} x {depth.height}, because the camera "
                f"says that colour is aligned to depth, got {size[1]} x {size[0]}; give the tracker an RGBDCamera "
                "with T_color_depth or projective, or resize the colour image"
            )
        return _core.ColorMap.aligned(depth.width, depth.height)
    if rig.color is not None and size != rig.color.shape:
        raise ValueError(
            f"color: expected the colour camera's size {rig.color.width} x {rig.color.height}, got "
            f"{size[1]} x {size[0]}; scale the colour camera with Camera.scaled"
        )
    if rig.T_color_depth is not None:
        assert rig.color is not None
        return _core.ColorMap.rigid(depth._core, rig.color._core, rig.T_color_depth)
    assert rig.projective is not None
    P, q = rig.projective
    return _core.ColorMap.projective(np.ascontiguousarray(P), np.ascontiguousarray(q), size[1], size[0])
