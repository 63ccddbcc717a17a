# SPDX-License-Identifier: MIT
"""A ball that renders itself and results made by hand: what drawing and recording need, without a tracker."""

import numpy as np

from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.results import Status, TrackResult

CAMERA = Camera(200.0, 200.0, 79.5, 59.5, 160, 121)  # an odd height on purpose
RADIUS_M = 0.06


class Ball:
    """A sphere about the object's origin with the two methods that drawing calls."""

    bounds = np.array([[-RADIUS_M] * 3, [RADIUS_M] * 3])

    def render(self, camera, T):
        rays = np.dstack([camera.rays, np.ones(camera.shape)]).astype(np.float64)
        centre = T[:3, 3]
        a, b = (rays**2).sum(-1), rays @ centre
        root = b**2 - a * (centre @ centre - RADIUS_M**2)
        z = np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, 0.0)
        normals = (rays * z[..., None] - centre) / RADIUS_M
        normals[z <= 0] = 0
        return z.astype(np.float32), normals.astype(np.float32)

    def raycast(self, camera, T, threads=0):
        depth, normals = self.render(camera, T)
        return depth, normals, None


def pose(x=0.0, y=0.0, z=0.5):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def frame(i=0, T=None, color=False):
    depth = np.full(CAMERA.shape, 0.9, np.float32)
    if T is not None:
        ball, _ = Ball().render(CAMERA, T)
        depth[ball > 0] = ball[ball > 0]
    grey = np.full((*CAMERA.shape, 3), 90, np.uint8) if color else None
    return Frame(depth, grey, timestamp=i / 30.0, index=i)


def result(poses, status=None, i=0):
    m = len(poses)
    status = [Status(s) for s in (status or ["ok"] * m)]
    covariances = np.tile(1e-8 * np.eye(6), (m, 1, 1))
    for k, s in enumerate(status):
        if s in (Status.LOST, Status.BAD_FRAME):
            covariances[k] = np.nan
    return TrackResult(
        poses=np.array(poses, np.float64), status=status,
        reason=["" if s is Status.OK else "made so by the test" for s in status],
        confidence=np.array([0.0 if s is Status.LOST else 0.9 for s in status]), covariances=covariances,
        twists=np.full((m, 6), np.nan), inliers=np.full(m, 0.8), runner_up=np.full(m, np.nan), energy=0.1,
        seconds=0.002, timestamp=i / 30.0, index=i,
    )  # fmt: skip
