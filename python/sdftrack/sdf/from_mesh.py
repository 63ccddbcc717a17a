# SPDX-License-Identifier: MIT
"""Conversion of a mesh to signed distances (docs/math/mesh_to_sdf.md), and its report."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.mesh import Mesh, unit_scale, vertex_colors
from sdftrack.sdf.grid import check_voxels


@dataclass(frozen=True)
class MeshReport:
    """Properties of a mesh before its conversion to a distance field, after merging equal vertices.

    Attributes
    ----------
    watertight : bool
        Every edge is used equally often in both directions, so there is an inside.
    merged_vertices, degenerate_faces, duplicate_faces, flipped_faces : int
        Repaired: equal vertices merged, faces without area and duplicate faces removed, faces oriented against their
        neighbours flipped.
    double_sided_faces, inverted_parts : int
        Repaired: double-sided faces, of which one side was kept; parts that were inside out, which were flipped.
    open_edges, non_manifold_edges : int
        Edges of only one face, and of more than two faces.
    parts : int
        Number of connected parts.
    volume : float
        m^3; meaningless for an open mesh.
    thinnest : float
        m; all but the thinnest 2 % of the surface have at least this thickness of material behind them.
    """

    watertight: bool
    merged_vertices: int
    degenerate_faces: int
    duplicate_faces: int
    flipped_faces: int
    open_edges: int
    non_manifold_edges: int
    parts: int
    volume: float
    thinnest: float
    double_sided_faces: int = 0
    inverted_parts: int = 0


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
    mesh: Mesh, voxels: int, padding: float | None, unit: str | None, holes: str, color: bool, threads: int
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
