# SPDX-License-Identifier: MIT
"""What plain fusion of truncated distances gets with the true poses: a baseline that has no pose to find (Open3D)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.reproduce.measures.whole_scene import open3d

__all__ = ["fused"]

TRUNCATION_VOXELS = 5.0
MIN_WEIGHT = 3.0  # frames; the default of Open3D
FARTHEST_M = 3.0
BLOCKS = 4000  # of 16^3 voxels; the grid takes more when it needs them


def fused(seq: Any, n: int, poses: NDArray[np.float64], voxel_m: float) -> Any:
    """Mesh (object frame) of the object's true pixels fused at `poses` (n, 4, 4) T_cam_obj.

    The pixels are those of the true masks: this baseline has no figure and ground to tell apart, either.
    """
    from sdftrack.mesh import Mesh

    o3d = open3d()
    tensor = o3d.core.Tensor
    one = o3d.core.float32
    grid = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight"), (one, one), ((1), (1)), voxel_m, 16, BLOCKS)
    K = tensor(np.ascontiguousarray(depth_camera(seq.camera).K, np.float64))
    for i in range(n):
        depth = np.where(seq.masks(i)[0], seq[i].depth, np.float32(0))
        image = o3d.t.geometry.Image(tensor(depth[..., None].copy()))
        at = (K, tensor(np.ascontiguousarray(poses[i])), 1.0, FARTHEST_M, TRUNCATION_VOXELS)
        grid.integrate(grid.compute_unique_block_coordinates(image, *at), image, *at)
    mesh = grid.extract_triangle_mesh(MIN_WEIGHT)
    return Mesh(mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy())
