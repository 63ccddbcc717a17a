# SPDX-License-Identifier: MIT
"""Poses that put two solids into one place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sdftrack.sdf import SDF

__all__ = ["Solid", "overlaps"]

OVERLAP = 0.5  # of an object's half thickness; errors of the poses stay well below


class Solid:
    """What is asked of a shape: the point farthest inside it, and the ball about that which holds all of it."""

    def __init__(self, shape: SDF) -> None:
        self.shape = shape
        inside = np.argwhere(shape.values <= 0)
        z, y, x = np.unravel_index(int(np.argmin(shape.values)), shape.values.shape)
        self.depth_m = -float(shape.values[z, y, x])
        self.point = np.append(shape.origin + shape.voxel_size * np.array([x, y, z]), 1.0)  # homogeneous
        corners = np.stack([inside.min(axis=0) - 1, inside.max(axis=0) + 1]) - np.array([z, y, x])
        self.reach_m = float(shape.voxel_size * np.linalg.norm(np.abs(corners).max(axis=0)))


def overlaps(
    solids: Sequence[Solid], poses: NDArray[np.float64], of: Sequence[int]
) -> Iterator[tuple[int, int]]:
    """Pairs (k, j) among `of` where the middle of j lies deep inside k; `poses` are T_cam_obj, (M, 4, 4)."""
    if len(of) < 2:
        return
    middle = {k: poses[k] @ solids[k].point for k in of}
    for k in of:
        for j in of:
            if j == k or np.linalg.norm(middle[j] - middle[k]) > solids[k].reach_m:
                continue
            in_k = np.linalg.solve(poses[k], middle[j])[:3]
            if solids[k].shape(in_k) < -OVERLAP * solids[j].depth_m:
                yield k, j
