# SPDX-License-Identifier: MIT
"""A shaded image of a shape, for notebooks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core

SIZE_PX = 240


def shaded_picture(
    render: Callable[[Any, NDArray[np.float64]], tuple[NDArray[Any], NDArray[Any]]],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> bytes:
    """PNG of a shape whose box is low..high (m), seen from its front, above and right."""
    import cv2

    radius = 0.5 * float(np.linalg.norm(high - low)) or 1.0
    forward = np.array([-1.0, 1.0, -0.6]) / np.linalg.norm([-1.0, 1.0, -0.6])
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = -R @ (0.5 * (low + high)) + [0, 0, 4 * radius]
    middle = (SIZE_PX - 1) / 2
    camera = _core.Camera(2 * SIZE_PX - 20, 2 * SIZE_PX - 20, middle, middle, SIZE_PX, SIZE_PX)
    depth, normals = render(camera, T)
    light = np.array([-0.4, -0.6, -0.7]) / np.linalg.norm([-0.4, -0.6, -0.7])
    shade = 0.25 + 0.75 * np.clip(normals @ light, 0, 1)
    picture = np.where(depth[..., None] > 0, shade[..., None] * [0.55, 0.7, 0.95], 1.0)
    bgr = np.round(255 * picture[..., ::-1]).astype(np.uint8)
    return bytes(cv2.imencode(".png", bgr)[1].tobytes())
