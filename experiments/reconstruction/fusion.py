# SPDX-License-Identifier: MIT
"""Baselines of Open3D: fusion of truncated distances, and a camera followed frame against model, as KinectFusion."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.frame import Frame
from sdftrack.geometry import inverse

Array = NDArray[np.float64]
SCENE_VOXEL_M, SCENE_TRUNCATION_VOXELS = 1 / 384, 8.0  # of the thesis
NEAREST_M = 0.1
JUMP_M = 0.07  # farther apart a measurement and the model are no pair; the default of Open3D
BLOCKS_OF_A_SCENE = 6000

TRUNCATION_VOXELS = 5.0
MIN_WEIGHT = 3.0  # frames; the default of Open3D
FARTHEST_M = 3.0
BLOCKS = 4000  # of 16^3 voxels; the grid takes more when it needs them


def open3d() -> Any:
    """The module; ImportError says how to get it."""
    try:
        import open3d as module
    except ImportError:
        raise ImportError("this baseline needs Open3D, which is not installed; pip install open3d") from None
    return module


def camera_path(
    seq: Any,
    n: int,
    step: Callable[[int, Any, Any], None] | None = None,
    *,
    voxel_m: float = SCENE_VOXEL_M,
    truncation_voxels: float = SCENE_TRUNCATION_VOXELS,
) -> Array:
    """(n, 4, 4) T_first_cam of the camera in the frame of its first place; ImportError without Open3D.

    `step` is told each frame's number, the depth image of the model as it is by then (m, 0: nothing), and the model.
    """
    o3d = open3d()
    slam, tensor, cpu = o3d.t.pipelines.slam, o3d.core.Tensor, o3d.core.Device("CPU:0")
    camera = depth_camera(seq.camera)
    K = tensor(np.ascontiguousarray(camera.K, np.float64))
    model = slam.Model(voxel_m, 16, BLOCKS_OF_A_SCENE, tensor(np.eye(4)), cpu)
    seen, drawn = (slam.Frame(camera.height, camera.width, K, cpu) for _ in range(2))
    T = np.eye(4)
    path = [T]
    quiet = o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error)
    with quiet:
        for i in range(n):
            color = seq[i].color.astype(np.float32) / 255  # the model wants some; it is followed by depth
            for name, image in (("depth", seq[i].depth[..., None]), ("color", color)):
                seen.set_data_from_image(name, o3d.t.geometry.Image(tensor(np.array(image))))
            if i:
                found = model.track_frame_to_model(seen, drawn, 1.0, FARTHEST_M, JUMP_M)
                T = T @ found.transformation.cpu().numpy()
                path.append(T)
            model.update_frame_pose(i, tensor(T))
            model.integrate(seen, 1.0, FARTHEST_M, truncation_voxels)
            model.synthesize_model_frame(drawn, 1.0, NEAREST_M, FARTHEST_M, truncation_voxels, False)
            if step is not None:
                step(i, drawn.get_data_as_image("depth").as_tensor().numpy()[..., 0], model)
    return np.array(path)


def own_depth(seq: Any, i: int) -> NDArray[np.float32]:
    """(H, W) depth of frame i at the object's true pixels, m; 0 elsewhere."""
    return np.where(seq.masks(i)[0], seq[i].depth, np.float32(0))


def fused(seq: Any, n: int, poses: Array, voxel_m: float) -> Any:
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


def tracked(seq: Any, n: int, first: Array, voxel_m: float) -> tuple[Array, Array]:
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

    def step(i: int, *_: Any) -> None:
        ends[i] = time.perf_counter()

    path = camera_path(Timed(), n, step, voxel_m=voxel_m, truncation_voxels=TRUNCATION_VOXELS)
    return inverse(path) @ first, np.array(ends) - np.array(begins)
