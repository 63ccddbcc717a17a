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
    elif not hasattr(mesh, "faces") and (hasattr(mesh, "triangles") or hasattr(mesh, "triangle")):
        mesh = _of_open3d(mesh)
    elif not isinstance(mesh, Mesh):
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise TypeError(
                "mesh: expected a path, Mesh, trimesh.Trimesh, Open3D mesh or (vertices, faces), got "
                f"{type(mesh).__name__}"
            )
        mesh = Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), vertex_colors(mesh))
    return mesh


def _of_open3d(mesh: Any) -> Mesh:
    """Open3D's TriangleMesh, whose colours are 0..1, or its tensor form, in which they may be uint8."""
    if hasattr(mesh, "triangles"):
        vertices, faces, colors = mesh.vertices, mesh.triangles, mesh.vertex_colors
    else:
        vertices, faces = (t.cpu().numpy() for t in (mesh.vertex["positions"], mesh.triangle["indices"]))
        has_colors = "colors" in mesh.vertex
        colors = mesh.vertex["colors"].cpu().numpy() if has_colors else ()
    rgb = np.asarray(colors)
    if rgb.size and rgb.dtype.kind == "f":
        rgb = np.round(255 * np.clip(rgb, 0, 1)).astype(np.uint8)
    return Mesh(np.asarray(vertices), np.asarray(faces), rgb if rgb.size else None)


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
