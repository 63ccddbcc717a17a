# SPDX-License-Identifier: MIT
"""Proxy volume for a plane patch: a plate hidden behind it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.sdf import SDF
from sdftrack.sdf.grid import MAX_VOXELS, grid_round

__all__ = ["plate_of"]

TAN_HIDDEN = math.sqrt(3)  # of 60 degrees: views within that see no side of the plate
DEPTH = 0.8  # of the depth at which its sides would meet: the farther its back, the fewer measurements are drawn to it
MIN_VOXELS = 5  # along the depth, else the volume has no inside to speak of


def plate_of(width: float, height: float, voxels: int) -> SDF:
    """A frustum (m) whose front is the rectangle at z = 0, with at least this many voxels along its longest side."""
    depth = DEPTH * min(width, height) / (2 * TAN_HIDDEN)
    vertices, faces = _frustum(width, height, depth, depth * TAN_HIDDEN)
    voxels = max(voxels, min(MAX_VOXELS, math.ceil(MIN_VOXELS * max(width, height) / depth)))
    voxel_size, shape, origin = grid_round(vertices.min(axis=0), vertices.max(axis=0), voxels, None)
    values, _ = _core.mesh_to_sdf(vertices, faces, shape, voxel_size, list(origin))
    return SDF(values, voxel_size, origin)


def _frustum(
    width: float, height: float, depth: float, inset: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    front = np.column_stack([corners * [width, height], np.zeros(4)])
    back = np.column_stack([corners * [width - 2 * inset, height - 2 * inset], np.full(4, -depth)])
    faces = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]
    for i in range(4):
        j = (i + 1) % 4
        faces += [[i, i + 4, j], [j, i + 4, j + 4]]
    return np.concatenate([front, back]), np.array(faces, np.int32)
