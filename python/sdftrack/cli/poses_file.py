# SPDX-License-Identifier: MIT
"""First poses from a file: ``{"T_cam_obj": [4x4, ...]}``, in the order of the models."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # `--help` needs no numpy
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["read_poses"]

FARTHEST_M = 50.0  # beyond the depth cameras there are


def read_poses(path: Path, count: int) -> list[NDArray[np.float64]]:
    """First poses from ``{"T_cam_obj": [4x4, ...]}``, in the order of the models."""
    import numpy as np

    from sdftrack._internal.text_files import read_json
    from sdftrack.geometry import rigid

    if not path.is_file():
        raise FileNotFoundError(f"--init: no such file: {path}")
    value = read_json(path)
    poses = value.get("T_cam_obj") if isinstance(value, dict) else None
    if not isinstance(poses, list):
        raise ValueError(f'--init {path}: expected {{"T_cam_obj": [4x4, ...]}}, in the order of the models')
    if len(poses) != count:
        raise ValueError(
            f"--init {path}: expected T_cam_obj to list one 4x4 matrix per --model ({count}), got {len(poses)}"
        )
    read = []
    for k, p in enumerate(poses):
        try:
            matrix = np.asarray(p, np.float64)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"--init {path}: T_cam_obj[{k}]: expected a 4x4 matrix of numbers") from None
        try:
            T = rigid(matrix, f"T_cam_obj[{k}]")
        except (TypeError, ValueError) as error:
            raise ValueError(f"--init {path}: {error}") from None
        _check_place(T, f"--init {path}: T_cam_obj[{k}]")
        read.append(T)
    return read


def _check_place(T: NDArray[np.float64], name: str) -> None:
    distance, z = math.hypot(*T[:3, 3]), float(T[2, 3])
    if distance > FARTHEST_M:
        raise ValueError(
            f"{name}: the object is {distance:.4g} m away; translations are metres, are these mm?"
        )
    if z <= 0:
        raise ValueError(
            f"{name}: the object is behind the camera (z = {z:.4g} m); expected T_cam_obj, object to camera"
        )
