# SPDX-License-Identifier: MIT
"""A camera followed by all that stands still before it, frame against fused model, as KinectFusion does (Open3D)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera

__all__ = ["camera_path", "open3d"]

Array = NDArray[np.float64]
VOXEL_M = 1 / 384  # of the thesis
TRUNCATION_VOXELS = 8.0
MIN_WEIGHT = 1.0
NEAREST_M, FARTHEST_M = 0.1, 3.0
JUMP_M = 0.07  # farther apart a measurement and the model are no pair; the default of Open3D
BLOCKS = 6000  # of 16^3 voxels; the grid takes more when it needs them


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
    step: Callable[[int], None] | None = None,
    *,
    voxel_m: float = VOXEL_M,
    truncation_voxels: float = TRUNCATION_VOXELS,
) -> Array:
    """(n, 4, 4) T_first_cam of the camera in the frame of its first place; ImportError without Open3D."""
    o3d = open3d()
    slam, tensor, cpu = o3d.t.pipelines.slam, o3d.core.Tensor, o3d.core.Device("CPU:0")
    camera = depth_camera(seq.camera)
    K = tensor(np.ascontiguousarray(camera.K, np.float64))
    model = slam.Model(voxel_m, 16, BLOCKS, tensor(np.eye(4)), cpu)
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
                step(i)
    return np.array(path)
