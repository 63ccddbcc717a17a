# SPDX-License-Identifier: MIT
"""Background of overlays: the colour image aligned to depth, or the depth image in colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["backdrop", "depth_picture"]

Picture = NDArray[np.uint8]
NOTHING_RGB = (22, 24, 30)  # pixels without a measurement


def backdrop(frame: Any, camera: Any) -> Picture:
    """H x W x 3 uint8 RGB, a new array aligned with the camera's depth image."""
    shape = _depth_camera(camera).shape
    if frame.color is not None:
        if getattr(camera, "aligned", True):
            if frame.color.shape[:2] == shape:
                return np.array(frame.color)
        elif frame.depth is not None:
            return _warped(frame, camera)
    if frame.depth is not None:
        return depth_picture(frame.depth)
    return np.full((*shape, 3), NOTHING_RGB, np.uint8)


def _depth_camera(camera: Any) -> Any:
    return getattr(camera, "depth", camera)


def depth_picture(depth: NDArray[np.float32]) -> Picture:
    """Colour-coded depth: near is warm, far is cool, with soft shading by slope; missing depth is near black."""
    import cv2

    seen = depth > 0
    sample = depth[::8, ::8]
    sample = sample[sample > 0]
    if not sample.size:
        return np.full((*depth.shape, 3), NOTHING_RGB, np.uint8)
    near, far = np.percentile(sample, [1, 97])
    level = np.clip((far - depth) / max(far - near, 1e-3), 0, 1)  # 1 near
    table = _palette()
    picture = table[(255 * level).astype(np.uint8)]
    smooth = cv2.blur(depth, (3, 3))
    step = cv2.Sobel(smooth, cv2.CV_32F, 1, 1, ksize=3, scale=18.0 / max(far - near, 0.05))
    relief = (1.0 + np.clip(step, -0.22, 0.22))[..., None]
    picture = np.clip(picture * relief, 0, 255).astype(np.uint8)
    picture[~seen] = NOTHING_RGB
    return picture


def _palette() -> NDArray[np.float32]:
    """256 x 3: ink blue (far) over slate and sand to cream (near); muted, so that overlays are visible."""
    stops = np.array(
        [[28, 38, 62], [52, 82, 110], [110, 134, 138], [184, 166, 132], [240, 226, 196]], np.float32
    )
    at = np.linspace(0, 255, len(stops))
    return np.column_stack([np.interp(np.arange(256), at, stops[:, k]) for k in range(3)]).astype(np.float32)


def _warped(frame: Any, camera: Any) -> Picture:
    """Colour of every depth pixel; pixels without depth use the depth of their surroundings."""
    import cv2

    depth_camera = _depth_camera(camera)
    depth = _filled(frame.depth)
    # The mapping is affine in homogeneous colour coordinates for a fixed pixel: y = a(u, v) Z + b.
    if camera.projective is not None:
        P, q = camera.projective
        v, u = np.mgrid[0 : depth_camera.height, 0 : depth_camera.width].astype(np.float32)
        direction = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.asarray(P, np.float32).T
        y = direction * depth[..., None] + np.asarray(q, np.float32)
        px = y[..., :2] / np.maximum(y[..., 2:], 1e-6)
    else:
        rays = depth_camera.rays
        points = np.dstack([rays * depth[..., None], depth]).astype(np.float64)
        px = camera.project_to_color(points).astype(np.float32)
    out = cv2.remap(
        frame.color, np.ascontiguousarray(px[..., 0]), np.ascontiguousarray(px[..., 1]), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT, borderValue=NOTHING_RGB,
    )  # fmt: skip
    return np.asarray(out, np.uint8)


def _filled(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Depth with holes filled by the farthest measurement nearby, because most are shadows on the background."""
    import cv2

    holes = depth <= 0
    if not holes.any():
        return depth
    coarse = cv2.dilate(depth, np.ones((9, 9), np.uint8))[::8, ::8].copy()
    for _ in range(12):
        empty = coarse <= 0
        if not empty.any():
            break
        coarse[empty] = cv2.dilate(coarse, np.ones((7, 7), np.uint8))[empty]
    coarse[coarse <= 0] = float(depth.max()) or 1.0
    fill = cv2.resize(coarse, depth.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.where(holes, fill, depth)
