# SPDX-License-Identifier: MIT
"""Three planes that meet in a corner, each fitted to all of its measurements."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera, depth_camera
from sdftrack.frame import Frame
from sdftrack.imaging.plane import KINECT, remove_plane

__all__ = ["three_planes"]

Array = NDArray[np.float64]
APART = 3.0  # slabs: measurements nearer to a second plane are of an edge, where the sensor mixes both
ROUNDS = 2  # of sharing out and fitting: after the first one nothing moves by more than its own error


def three_planes(frame: Frame, camera: Any, tolerance: float) -> tuple[Array, Array]:
    """The three largest planes of a depth image: (3, 3) unit normals (rows) towards the camera, and (3,) offsets, m.

    They are found sequentially. Then each is refitted to all measurements within its slab that are not near the other
    planes, weighted by the sensor's noise along the ray: a linear fit of inverse depth over pixels, which does not
    depend on the focal length or the principal point (docs/math/planes.md, section 6).
    """
    normals, offsets, rest = [], [], frame
    for _ in range(3):
        off_plane, (normal, offset) = remove_plane(rest, camera, tolerance=tolerance, feet=False)
        normals.append(normal)
        offsets.append(offset)
        assert rest.depth is not None  # remove_plane has looked
        rest = rest.replace(depth=np.where(off_plane, rest.depth, np.float32(0)))
    n, d = np.array(normals), np.array(offsets)
    pinhole = depth_camera(camera if camera is not None else frame.camera)  # type: ignore[arg-type]
    for _ in range(ROUNDS):
        n, d = _refitted(frame, pinhole, n, d, tolerance)
    return n, d


def _refitted(frame: Frame, camera: Camera, n: Array, d: Array, tolerance: float) -> tuple[Array, Array]:
    assert frame.depth is not None
    z = frame.depth.astype(np.float64)
    height = np.abs(camera.back_project(frame.depth) @ n.T + d)
    # The slab of measurements at their depth and angle, as remove_plane has it: three sd along the normal.
    rays = np.concatenate([camera.rays, np.ones((*camera.shape, 1), np.float32)], axis=-1)
    sigma = (KINECT[0] + KINECT[1] * (z - 0.4) ** 2)[..., None] * np.abs(rays @ n.T)
    near = height / np.maximum(tolerance, 3 * sigma)
    out_n, out_d = [], []
    for k in range(3):
        others = [j for j in range(3) if j != k]
        own = (z > 0) & (near[..., k] < 1) & (near[..., others] > APART).all(axis=-1)
        fitted = _core.fit_plane(
            frame.depth,
            camera._core,
            camera.rays if camera.distortion is not None else None,
            own.view(np.uint8),
            n[k],
            d[k],
            tolerance,
            KINECT,
        )
        out_n.append(n[k] if fitted is None else np.array(fitted[0]))
        out_d.append(d[k] if fitted is None else float(fitted[1]))
    return np.array(out_n), np.array(out_d)
