# SPDX-License-Identifier: MIT
"""Views of a solid in which one of its lengths is unobservable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.synth.solids import random_solid, ray_depth
from sdftrack.camera import Camera

WALL_M = 1.0  # behind the solid


def open_view(
    kind: str, rng: np.random.Generator, camera: Camera
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], str]:
    """A box from the front, a cylinder from its end, a cone from below, on the camera's axis.

    Returns
    -------
    depth, cosine : (H, W) float32
    mask : (H, W) bool
    hidden : str
        The unobservable length.
    """
    size = random_solid(kind, rng)
    away = rng.uniform(0.6, 1.2)
    length = size["z"] if kind == "box" else size["height"]
    # z of the solid along the view; a cone's base faces the camera.
    turn = rng.uniform(0, 2 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    t = np.array([0, 0, away + length / 2])
    rays = camera.back_project(np.ones(camera.shape, np.float32)).astype(np.float64).reshape(-1, 3)
    z, normals = ray_depth(kind, size, -R.T @ t, rays @ R)
    seen = np.isfinite(z)
    depth = np.where(seen, z, away + length + WALL_M)
    cosine = np.abs(np.where(seen, np.einsum("ni,ni->n", normals @ R.T, rays), rays[:, 2]))
    cosine /= np.linalg.norm(rays, axis=1)
    hidden = "z" if kind == "box" else "height"
    shape = camera.shape
    return (
        depth.reshape(shape).astype(np.float32),
        cosine.reshape(shape).astype(np.float32),
        seen.reshape(shape),
        hidden,
    )
