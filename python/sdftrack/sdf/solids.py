# SPDX-License-Identifier: MIT
"""Distances to analytic solids: sphere, box, cylinder, cone, ellipsoid."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import number, numbers, shown
from sdftrack.sdf.grid import MAX_VOXEL, grid_round


def distances_of_solid(
    kind: str, size: list[float], half: NDArray[np.float64], voxels: int, padding: float | None
) -> tuple[NDArray[np.float32], float, NDArray[np.float64]]:
    """Values (nz, ny, nx), voxel size and origin (m) of a solid whose box is -`half` to `half`."""
    lengths = [number(s, kind) for s in size]
    if not all(0 < s <= MAX_VOXEL for s in lengths):
        raise ValueError(f"{kind}: expected positive lengths in metres, at most {MAX_VOXEL:g}, got {lengths}")
    voxel_size, shape, origin = grid_round(-half, half, voxels, padding)
    return _core.primitive_sdf(kind, lengths, shape, voxel_size, list(origin)), voxel_size, origin


def three_lengths(a: ArrayLike, name: str) -> NDArray[np.float64]:
    """(3,) float64, or an error that names the argument."""
    v = numbers(a, name)
    if v.shape != (3,):
        raise ValueError(f"{name}: expected three numbers (x, y, z) in metres, got {shown(a)}")
    return v
