# SPDX-License-Identifier: MIT
"""Rendering in plain numpy: every ray against everything. Slow and obvious."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def raycast_mesh(
    vertices: Array, faces: Array, rays_xy: Array, T_cam_obj: Array, colors: Array | None = None
) -> tuple[Array, Array, Array | None]:
    """Depth, face normals (camera frame, towards the camera) and blended vertex colours.

    rays_xy : (H, W, 2), x / z and y / z of every pixel's ray. See `sdftrack.Mesh.raycast`.
    """
    height, width = rays_xy.shape[:2]
    rays = np.dstack([rays_xy, np.ones((height, width))]).astype(np.float64)
    p = vertices @ T_cam_obj[:3, :3].T + T_cam_obj[:3, 3]
    depth = np.full((height, width), np.inf)
    normals = np.zeros((height, width, 3))
    rgb = None if colors is None else np.zeros((height, width, 3))
    for face in faces:
        a, b, c = p[face]
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n)
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (n @ a) / (rays @ n)  # the ray meets the face's plane at z * ray
            hit = rays * z[..., None]
            area = n @ np.cross(b - a, c - a)
            weights = np.stack(
                [np.cross(c - b, hit - b) @ n, np.cross(a - c, hit - c) @ n, np.cross(b - a, hit - a) @ n], axis=-1
            ) / area  # fmt: skip
            better = (weights >= 0).all(axis=-1) & (z > 0) & (z < depth)
        depth[better] = z[better]
        normals[better] = n * -np.sign(rays[better] @ n)[:, None]
        if rgb is not None and colors is not None:
            rgb[better] = weights[better] @ colors[face].astype(np.float64)
    return np.where(np.isfinite(depth), depth, 0), normals, rgb
