# SPDX-License-Identifier: MIT
"""Sharp and smooth unions of shapes on a common grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import positive
from sdftrack.sdf.grid import Shape3, resample, shape_zyx, voxels_between
from sdftrack.sdf.volume import SDF


def union(*shapes: SDF) -> SDF:
    """Union of shapes in one object frame, on a common grid of the finest voxel, as a distance field.

    The minimum of two distances is exact outside, but not inside an overlap, so the result is redistanced.
    """
    grid = _common_grid(shapes)
    return SDF._own(np.minimum.reduce([resample(s, *grid) for s in shapes]), grid[1], grid[2]).redistanced()


def smooth_union(*shapes: SDF, radius: float = 0.01) -> SDF:
    """Union whose concave creases are rounded over about `radius` (m): soft minimum, then redistanced.

    -log(sum exp(-a phi_k)) / a with a = 4 log(2) / radius, so that where two surfaces meet the new one lies
    radius / 4 outside.
    """
    a = np.float32(4 * np.log(2) / positive(radius, "radius"))
    grid = _common_grid(shapes)
    joined = -a * resample(shapes[0], *grid)
    for shape in shapes[1:]:
        joined = np.logaddexp(joined, -a * resample(shape, *grid))
    return SDF._own(np.asarray(-joined / a, np.float32), grid[1], grid[2]).redistanced()


def _common_grid(shapes: tuple[SDF, ...]) -> tuple[Shape3, float, NDArray[np.float64]]:
    if not shapes or not all(isinstance(s, SDF) for s in shapes):
        raise TypeError("shapes: expected one or more SDF")
    voxel_size = min(s.voxel_size for s in shapes)
    bounds = np.array([s.bounds for s in shapes])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    n = voxels_between(low, high, voxel_size, shapes, "shapes")
    return shape_zyx(n), voxel_size, low
