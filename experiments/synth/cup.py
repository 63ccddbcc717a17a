# SPDX-License-Identifier: MIT
"""A ball carried in a cup (thesis, Figure 5.10): the cup moves, turns and tilts, the ball is never seen itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from sdftrack import geometry

Array = NDArray[np.float64]
RADIUS_M, WALL_M, HALF_M = 0.04, 0.004, 0.05  # of the cup: outside, its wall, half of its height
BALL_M = 0.029
PLAY_M = RADIUS_M - WALL_M - BALL_M
VOXEL_M = 0.002
IN_CUP = geometry.pose([0, 0, 0], [0, 0, WALL_M - HALF_M + BALL_M])  # on the bottom
CAMERA = st.Camera(260.0, 260.0, 159.5, 119.5, 320, 240)
BEHIND_M, NOISE_M = 1.2, 0.001


def cup() -> st.SDF:
    """Its axis is z, it is open at the top; analytic."""
    at = VOXEL_M * (np.arange(70) - 34.5)
    z, y, x = np.meshgrid(at, at, at, indexing="ij")

    def cylinder(radius: float, low: float, high: float) -> Array:
        q = np.stack([np.hypot(x, y) - radius, abs(z - (low + high) / 2) - (high - low) / 2], -1)
        out: Array = np.minimum(q.max(-1), 0) + np.linalg.norm(np.maximum(q, 0), axis=-1)
        return out

    inside = cylinder(RADIUS_M - WALL_M, WALL_M - HALF_M, HALF_M + 0.05)
    values = np.maximum(cylinder(RADIUS_M, -HALF_M, HALF_M), -inside).astype(np.float32)
    return st.SDF(values, VOXEL_M, origin=(at[0],) * 3)


def ball() -> st.SDF:
    at = VOXEL_M * (np.arange(41) - 20)
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    return st.SDF((np.sqrt(x**2 + y**2 + z**2) - BALL_M).astype(np.float32), VOXEL_M, origin=(at[0],) * 3)


@dataclass(frozen=True)
class Carried:
    """Frames and true poses (2, 4, 4) of cup and ball."""

    shapes: tuple[st.SDF, st.SDF]
    frames: list[st.Frame]
    poses: list[Array]


def carried(count: int) -> Carried:
    vessel = cup()
    mesh = vessel.to_mesh()
    frames, poses = [], []
    for i in range(count):
        turn = geometry.pose([0, 0.003 * i, 0.01 * i], [0, 0, 0])
        T = geometry.pose([np.pi / 2, 0, 0], [0.004 * i - 0.05, 0.002 * i, 0.6]) @ turn
        seen = mesh.raycast(CAMERA, T)[0]
        noise = np.random.default_rng(i).normal(0, NOISE_M, seen.shape)
        depth = (np.where(seen > 0, seen, BEHIND_M) + noise).astype(np.float32)
        frames.append(st.Frame(depth, timestamp=i / 30, index=i))
        poses.append(np.array([T, T @ IN_CUP]))
    return Carried((vessel, ball()), frames, poses)
