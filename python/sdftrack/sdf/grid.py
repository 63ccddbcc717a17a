# SPDX-License-Identifier: MIT
"""The grid of a volume: around a box, of an analytic solid, and resampling of another volume on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.saved_file import may_hold
from sdftrack._internal.validation import number, numbers, shown

if TYPE_CHECKING:
    from sdftrack.sdf.volume import SDF

MAX_VOXELS = _core.MAX_VOXELS  # along one side
FLOAT_BYTES = 4  # of a voxel
MIN_VOXEL, MAX_VOXEL, MAX_ORIGIN = 1e-12, 1e12, 1e15  # m; the core measures in float32

Shape3 = tuple[int, int, int]


def shape_zyx(n_xyz: NDArray[Any]) -> Shape3:
    """(nx, ny, nz) as the shape of an array [z, y, x]."""
    return int(n_xyz[2]), int(n_xyz[1]), int(n_xyz[0])


def voxels_between(
    low: NDArray[np.float64], high: NDArray[np.float64], voxel_size: float, sources: Sequence[SDF], name: str
) -> NDArray[np.int64]:
    """(nx, ny, nz) of the grid over a box."""
    # ValueError if it is far larger than the volumes that it is made of, as by a tiny voxel in a wide box.
    n = np.ceil((high - low) / voxel_size - 1e-6) + 1
    needed = FLOAT_BYTES * float(np.prod(n))
    if not n.max() <= MAX_VOXELS or not may_hold(sum(s.values.nbytes for s in sources), int(needed)):
        raise ValueError(
            f"{name}: the result would have {n[0]:g} x {n[1]:g} x {n[2]:g} voxels ({needed / 1e9:.3g} GB), much more "
            f"than what it is made of; use voxels of similar size, and at most {MAX_VOXELS} a side"
        )
    return n.astype(np.int64)


def check_voxels(voxels: int, padding: float | None) -> None:
    """ValueError, or TypeError, where no grid has so many voxels or such a padding."""
    if not (8 <= number(voxels, "voxels") <= MAX_VOXELS and voxels == int(voxels)):
        raise ValueError(
            f"voxels: expected a whole number from 8 to {MAX_VOXELS} along the longest side, got {shown(voxels)}"
        )
    if padding is not None and not (np.isfinite(number(padding, "padding")) and padding >= 0):
        raise ValueError(f"padding: expected a fraction of the longest side, 0 or more, got {padding}")


def grid_round(
    low: NDArray[np.float64], high: NDArray[np.float64], voxels: int, padding: float | None
) -> tuple[float, Shape3, NDArray[np.float64]]:
    """Voxel size, shape [z, y, x] and origin of the grid around a box."""
    check_voxels(voxels, padding)
    voxel_size, shape, origin = _core.grid_around(list(low), list(high), int(voxels), padding)
    return voxel_size, shape, np.array(origin)


def resample(
    sdf: SDF,
    shape: Shape3,
    voxel_size: float,
    origin: NDArray[np.float64],
    T: NDArray[np.float64] | None = None,
) -> NDArray[np.float32]:
    """Values of `sdf` at T (grid point), evaluated slice by slice."""
    nz, ny, nx = shape
    out = np.empty(shape, np.float32)
    xy = np.zeros((ny, nx, 3))
    xy[..., 0] = origin[0] + voxel_size * np.arange(nx)
    xy[..., 1] = origin[1] + voxel_size * np.arange(ny)[:, None]
    for iz in range(nz):
        xy[..., 2] = origin[2] + voxel_size * iz
        points = xy if T is None else xy @ T[:3, :3].T + T[:3, 3]
        out[iz] = sdf(points)
    return out


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
