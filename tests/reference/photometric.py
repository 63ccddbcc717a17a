# SPDX-License-Identifier: MIT
"""The photometric energy, pixel by pixel (docs/math/photometric.md)."""

import numpy as np
from numpy.typing import NDArray

from reference.sdf import sample

Array = NDArray[np.float64]
LUMA = np.array([0.299, 0.587, 0.114])


def brightness_at(rgba: NDArray[np.uint8], voxel_m: float, origin: Array, p: Array) -> float:
    """Trilinear brightness (0..1) of the known corners around p; NaN where less than half is known."""
    q = (p - origin) / voxel_m
    nz, ny, nx = rgba.shape[:3]
    if (q < 0).any() or (q > np.array([nx, ny, nz]) - 1).any():
        return np.nan
    cell = np.minimum(q.astype(int), np.array([nx, ny, nz]) - 2)
    total = weight = 0.0
    for corner in np.ndindex(2, 2, 2):
        x, y, z = cell + corner
        if rgba[z, y, x, 3] == 0:
            continue
        w = float(np.prod([q[a] - cell[a] if corner[a] else 1 - q[a] + cell[a] for a in range(3)]))
        total += w * float(rgba[z, y, x, :3] @ LUMA) / 255
        weight += w
    return total / weight if weight >= 0.5 else np.nan


def ray_hit(
    values: NDArray[np.float32], voxel_m: float, origin: Array, T_obj_cam: Array, ray: Array, depth_m: float
) -> float:
    """Depth at which a pixel's ray meets the surface, by Newton steps from `depth_m`."""
    along = T_obj_cam[:3, :3] @ ray
    for _ in range(30):
        phi, gradient = sample(values, voxel_m, origin, T_obj_cam[:3, 3] + depth_m * along)
        depth_m -= float(phi / (gradient @ along))
    return depth_m


def surface_normal(
    values: NDArray[np.float32], voxel_m: float, origin: Array, T_obj_cam: Array, p_cam: Array
) -> Array:
    """Unit normal of the field at a camera point, in the camera's frame."""
    _, gradient = sample(values, voxel_m, origin, T_obj_cam[:3, :3] @ p_cam + T_obj_cam[:3, 3])
    n: Array = T_obj_cam[:3, :3].T @ gradient
    return n / np.linalg.norm(n)


def photometric_cost(
    model: Array, normals: Array, grey: Array, sigma: float, rounds: int = 60
) -> tuple[float, Array]:
    """sum log(1 + r^2 / 2 sigma^2), r = (gain + shading . n) model + offset - grey, at the best tone, and that."""
    basis = np.column_stack([model, model[:, None] * normals, np.ones(len(model))])
    start, prior = np.array([1.0, 0, 0, 0, 0]), np.full(5, 1 / 0.2**2)
    tone = start
    for _ in range(rounds):
        r = basis @ tone - grey
        w = 1 / (sigma**2 + 0.5 * r**2)
        tone = np.linalg.solve((basis.T * w) @ basis + np.diag(prior), (basis.T * w) @ grey + prior * start)
    r = basis @ tone - grey
    cost = np.log1p(0.5 * (r / sigma) ** 2).sum() + 0.5 * prior @ (tone - start) ** 2
    return float(cost), tone
