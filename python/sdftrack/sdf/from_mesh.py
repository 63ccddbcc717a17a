# SPDX-License-Identifier: MIT
"""Conversion of a mesh to signed distances (docs/math/mesh_to_sdf.md)."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.mesh import Mesh, unit_scale, vertex_colors
from sdftrack.sdf.grid import check_voxels
from sdftrack.sdf.mesh_report import MeshReport


def mesh_of(mesh: Any) -> Mesh:
    """A path, Mesh, trimesh.Trimesh or (vertices, faces) as a `Mesh`."""
    if isinstance(mesh, (str, os.PathLike)):
        mesh = Mesh.load(mesh)
    elif isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        mesh = Mesh(mesh[0], mesh[1])
    elif not isinstance(mesh, Mesh):
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise TypeError(
                f"mesh: expected a path, Mesh, trimesh.Trimesh or (vertices, faces), got {type(mesh).__name__}"
            )
        mesh = Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), vertex_colors(mesh))
    return mesh


def distances_of_mesh(
    mesh: Mesh,
    voxels: int,
    padding: float | None,
    unit: str | None,
    holes: str,
    color: bool,
    threads: int,
) -> tuple[NDArray[np.float32], float, NDArray[np.float64], MeshReport]:
    """Values (nz, ny, nx), voxel size, origin (m) and report; the arguments and errors of `SDF.from_mesh`."""
    if color and mesh.colors is None:
        raise ValueError("mesh: expected colours at its vertices (color=True), got none")
    unit_m = None if unit is None else unit_scale(unit)
    check_voxels(voxels, padding)
    values, voxel_size, origin, report, texts = _core.mesh_volume(
        mesh.vertices, mesh.faces, int(voxels), padding, unit_m, holes == "close", threads
    )
    for text in texts:
        warnings.warn(text, stacklevel=3)
    return values, voxel_size, np.array(origin), MeshReport(**report)
