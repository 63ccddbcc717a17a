# SPDX-License-Identifier: MIT
"""Meshes of the shapes for the page, and shapes that are known as meshes only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.mesh import Mesh

__all__ = ["MeshShape", "light_mesh"]

MAX_FACES = 60_000  # a browser turns more, but a page takes seconds to load them
FEWER_FACES = 30_000


class MeshShape:
    """A mesh with what `draw` asks a shape for, so that a result is shown without building volumes."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.bounds = mesh.bounds

    def render(self, camera: Any, T_cam_obj: Any) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        return self.mesh.raycast(camera, T_cam_obj)[:2]

    def to_mesh(self) -> Mesh:
        return self.mesh


def light_mesh(mesh: Mesh) -> Mesh:
    """The mesh, simplified if it is large and the extra ``export`` is there."""
    if len(mesh.faces) <= MAX_FACES:
        return mesh
    try:
        return mesh.decimated(FEWER_FACES)
    except (ImportError, ValueError):
        return mesh
