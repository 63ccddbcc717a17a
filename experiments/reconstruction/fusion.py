# SPDX-License-Identifier: MIT
"""Baselines of Open3D: fusion of truncated distances, with the true poses or those of frame-to-model ICP."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.thesis.measures.whole_scene import camera_path, open3d
from sdftrack.camera import depth_camera
from sdftrack.frame import Frame
from sdftrack.geometry import inverse

__all__ = ["fused", "tracked"]

TRUNCATION_VOXELS = 5.0
MIN_WEIGHT = 3.0  # frames; the default of Open3D
FARTHEST_M = 3.0
BLOCKS = 4000  # of 16^3 voxels; the grid takes more when it needs them


def own_depth(seq: Any, i: int) -> NDArray[np.float32]:
    """(H, W) depth of frame i at the object's true pixels, m; 0 elsewhere."""
    return np.where(seq.masks(i)[0], seq[i].depth, np.float32(0))


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
        image = o3d.t.geometry.Image(tensor(own_depth(seq, i)[..., None].copy()))
        at = (K, tensor(np.ascontiguousarray(poses[i])), 1.0, FARTHEST_M, TRUNCATION_VOXELS)
        grid.integrate(grid.compute_unique_block_coordinates(image, *at), image, *at)
    mesh = grid.extract_triangle_mesh(MIN_WEIGHT)
    return Mesh(mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy())


def tracked(
    seq: Any, n: int, first: NDArray[np.float64], voxel_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Poses (n, 4, 4) T_cam_obj of the object by frame-to-model ICP, and the seconds of each frame.

    It is told which pixels are the object's in every frame, and the pose in the first one. Rendering is not counted.
    """
    begins, ends = [0.0] * n, [0.0] * n
    frames = [Frame(own_depth(seq, i), seq[i].color) for i in range(n)]

    class Timed:
        camera = seq.camera

        def __getitem__(self, i: int) -> Frame:
            begins[i] = begins[i] or time.perf_counter()
            return frames[i]

    def step(i: int) -> None:
        ends[i] = time.perf_counter()

    path = camera_path(Timed(), n, step, voxel_m=voxel_m, truncation_voxels=TRUNCATION_VOXELS)
    return inverse(path) @ first, np.array(ends) - np.array(begins)
