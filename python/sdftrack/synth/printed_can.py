# SPDX-License-Identifier: MIT
"""A can whose print alone shows how it is rotated about its axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.mesh import Mesh

Array = NDArray[np.float64]
CAN_RADIUS_M, CAN_HEIGHT_M = 0.033, 0.11
WAVES = 25  # of the print


def can_mesh(around: int = 240, along: int = 160) -> Mesh:
    """A can: nothing but its print, smooth waves of colour, shows how it is turned about its axis (z)."""
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    a, z = np.meshgrid(angle, np.linspace(-0.5, 0.5, along) * CAN_HEIGHT_M)
    side = np.column_stack([CAN_RADIUS_M * np.cos(a).ravel(), CAN_RADIUS_M * np.sin(a).ravel(), z.ravel()])
    vertices = np.vstack([side, [[0, 0, -CAN_HEIGHT_M / 2], [0, 0, CAN_HEIGHT_M / 2]]])
    i, rim = np.arange(around * (along - 1)), np.arange(around)
    right, next_ = i - i % around + (i + 1) % around, (rim + 1) % around
    last = around * (along - 1)
    bottom, top = np.full(around, len(side)), np.full(around, len(side) + 1)
    corners = [
        (i, right, right + around),
        (i, right + around, i + around),
        (bottom, next_, rim),
        (top, rim + last, next_ + last),
    ]
    faces = np.vstack([np.column_stack(c) for c in corners]).astype(np.int32)
    return Mesh(vertices, faces, _print(vertices))


def _print(vertices: Array) -> NDArray[np.uint8]:
    rng = np.random.default_rng(0)
    around, along = np.arctan2(vertices[:, 1], vertices[:, 0]), vertices[:, 2]
    shown = np.zeros(vertices.shape)
    for _ in range(WAVES):
        wave = rng.integers(1, 12) * around + rng.uniform(-150, 150) * along + rng.uniform(0, 2 * np.pi)
        shown += rng.normal(size=3) * np.sin(wave)[:, None]
    return np.clip(128 + 32 * shown / shown.std(), 0, 255).astype(np.uint8)


def turning_can(n: int) -> Array:
    """(n, 4, 4) T_cam_obj of a can that turns about its own axis by 2 degrees a frame, and wanders."""
    poses = np.tile(np.eye(4), (n, 1, 1))
    for i in range(n):
        a, b = np.radians(2 * i), np.radians(100 + 6 * np.sin(i / 15))
        about = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
        tilt = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
        poses[i, :3, :3] = tilt @ about
        poses[i, :3, 3] = [0.03 * np.sin(i / 20), 0.02 * np.cos(i / 17), 0.6 + 0.03 * np.sin(i / 25)]
    return poses
