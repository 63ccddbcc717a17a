# SPDX-License-Identifier: MIT
"""Poses that put two solids into one place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sdftrack.sdf import SDF

__all__ = ["Solid", "overlaps"]

OVERLAP = 0.5  # of an object's half thickness; errors of the poses stay well below


class Solid:
    """What is asked of a shape that may stand where another does; found out when it is first asked."""

    def __init__(self, shape: SDF) -> None:
        self.shape = shape

    @cached_property
    def _deepest(self) -> tuple[int, int, int]:
        z, y, x = np.unravel_index(int(np.argmin(self.shape.values)), self.shape.values.shape)
        return int(z), int(y), int(x)

    @cached_property
    def depth_m(self) -> float:
        """How far the deepest point lies inside."""
        return -float(self.shape.values[self._deepest])

    @cached_property
    def point(self) -> NDArray[np.float64]:
        """The deepest point, object frame, homogeneous."""
        return np.append(self.shape.origin + self.shape.voxel_size * np.array(self._deepest[::-1]), 1.0)

    @cached_property
    def reach_m(self) -> float:
        """Radius of a ball about the deepest point that holds the whole solid."""
        inside = self.shape.values <= 0
        corners = []
        for axis in range(3):
            filled = np.flatnonzero(inside.any(axis=tuple(a for a in range(3) if a != axis)))
            corners.append(max(self._deepest[axis] - filled[0], filled[-1] - self._deepest[axis]) + 1)
        return float(self.shape.voxel_size * np.linalg.norm(corners))


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
