# SPDX-License-Identifier: MIT
"""The zero set of a volume as a mesh, on the CPU or a GPU."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.device import CPU

__all__ = ["zero_mesh"]


def zero_mesh(
    values: NDArray[np.float32], number: int = CPU
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (x, y, z in voxels) and faces, outwards, by marching cubes on GPU `number` or the CPU.

    Both have the same vertices, but in cells with a face of which only opposite corners are inside: scikit-image asks
    there how the corners' values are connected, and the GPU always separates them.
    """
    if number != CPU:
        vertices, faces = _core.zero_mesh(values, number)
        return vertices, faces
    from skimage.measure import marching_cubes

    zyx, faces, _, _ = marching_cubes(values, 0.0, gradient_direction="ascent")
    return zyx[:, ::-1].astype(np.float64), faces.astype(np.int32)
