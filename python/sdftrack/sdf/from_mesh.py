# SPDX-License-Identifier: MIT
"""Conversion of a mesh to signed distances: validation, grid, sign (docs/math/mesh_to_sdf.md)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.mesh import Mesh, unit_scale, vertex_colors
from sdftrack.sdf.grid import grid_round
from sdftrack.sdf.mesh_report import (
    MeshReport,
    enough_voxels,
    openness,
    use_voxels,
    voxels_for_thinnest,
    warn,
    warn_of,
)

LARGEST, SMALLEST = 3.0, 3e-3  # m; a side beyond these is more likely a wrong unit than an object
THIN_FRACTION = 0.02  # of the surface: less than that is the rim of an edge, more is a wall


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
    vertices, faces = mesh.vertices * unit_scale(unit), mesh.faces
    vertices, faces = _without_unused(vertices, faces)
    vertices, faces, found = _core.clean_mesh(vertices, faces, THIN_FRACTION)
    if len(faces) == 0:
        raise ValueError("mesh: expected at least one triangle with an area, got none")
    watertight = found.pop("unbalanced_edges") == 0
    report = MeshReport(watertight=watertight, **found)
    used = vertices[np.unique(faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    _check_size(high - low, unit)
    voxel_size, shape, origin = grid_round(low, high, voxels, padding)
    _check_voxels(high - low, voxel_size, voxels)
    grid = (shape, voxel_size, list(origin))
    if watertight:
        values, gaps = _core.mesh_to_sdf(vertices, faces, *grid, threads=threads)
        if gaps:
            warn(
                f"mesh: it intersects itself: {gaps} voxels lie inside faces that point inwards; their winding number "
                "is below 0 and they count as outside"
            )
    else:
        values, gaps = _core.open_mesh_to_sdf(vertices, faces, *grid, threads=threads)
        if holes == "error" and (gaps or not (values < 0).any()):
            raise ValueError(
                f"mesh: expected a closed surface, got {openness(report)}; close it in a mesh editor, or pass "
                "holes='close' to let the winding number close it"
            )
        if holes == "error":
            warn(
                f"mesh: it has {openness(report)}, but no gap as wide as a voxel; it was closed by the winding number"
            )
    if not (values < 0).any():
        thin = (
            f"{use_voxels(voxels_for_thinnest(report, voxel_size, voxels)).rstrip(',')}, or "
            if report.thinnest < 2 * voxel_size
            else ""
        )
        raise ValueError(
            f"mesh: no voxel lies inside it at a voxel size of {1e3 * voxel_size:.2g} mm; {thin}"
            "check that it encloses a volume and that its faces point outwards"
        )
    warn_of(report, voxel_size, voxels)
    return values, voxel_size, origin, report


def _without_unused(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Remove unused non-finite vertices; ValueError for non-finite vertices that are used by a face."""
    if len(vertices) == 0 or len(faces) == 0:
        cloud = "; a point cloud has no inside: reconstruct a surface from it first" if len(vertices) else ""
        raise ValueError(
            f"mesh: it is empty ({len(vertices)} vertices, {len(faces)} faces); expected triangles{cloud}"
        )
    bad = ~np.isfinite(vertices).all(axis=1)
    if not bad.any():
        return vertices, faces
    used = np.zeros(len(vertices), bool)
    used[faces.ravel()] = True
    if (bad & used).any():
        raise ValueError(
            f"mesh: {np.count_nonzero(bad & used)} of {len(vertices)} vertices are NaN or infinite and belong to "
            "faces; repair or remove these faces"
        )
    warn(
        f"mesh: {np.count_nonzero(bad)} vertices that are NaN or infinite belong to no face and were dropped"
    )
    new = np.cumsum(~bad) - 1
    return np.ascontiguousarray(vertices[~bad]), np.ascontiguousarray(new[faces].astype(np.int32))


def _check_size(extent: NDArray[np.float64], unit: str | None) -> None:
    side = float(extent.max())
    if SMALLEST <= side <= LARGEST:
        return
    if unit is None:
        hint = (
            "is it in mm? pass unit='mm'"
            if side > LARGEST
            else "in which unit is it? pass unit='m' if this is meant"
        )
        raise ValueError(
            f"mesh: its longest side is {side:.4g} m, expected 3 mm to 3 m; {hint} (or 'cm', 'in')"
        )


def _check_voxels(extent: NDArray[np.float64], voxel_size: float, voxels: int) -> None:
    shortest = float(extent.min())
    if shortest < 4 * voxel_size:
        if shortest <= 0:
            raise ValueError("mesh: it is flat (no extent along one axis); expected a solid")
        need = use_voxels(enough_voxels(voxels, 4 * voxel_size / shortest))
        raise ValueError(
            f"voxels: the shortest side of the object, {1e3 * shortest:.3g} mm, is under 4 voxels of "
            f"{1e3 * voxel_size:.3g} mm; {need} or less padding"
        )
