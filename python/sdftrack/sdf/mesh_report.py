# SPDX-License-Identifier: MIT
"""Report on a mesh before its conversion to a volume, and warnings about thin and open parts."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from sdftrack.sdf.grid import MAX_VOXELS


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


def openness(report: MeshReport) -> str:
    """Reason why it is not watertight."""
    kinds = [f"{report.open_edges} open edges"] if report.open_edges else []
    kinds += (
        [f"{report.non_manifold_edges} edges in more than two faces"] if report.non_manifold_edges else []
    )
    return " and ".join(kinds) or "faces of opposite orientation"


def enough_voxels(voxels: int, factor: float) -> int:
    """`voxels` times a factor, rounded up to a multiple of ten; of thin parts a number that is beyond all volumes."""
    return int(np.ceil(min((voxels - 1) * factor + 1, 1e9) / 10) * 10)


def use_voxels(voxels: int) -> str:
    """Advice to use this many voxels, or that no number suffices."""
    if voxels > MAX_VOXELS:
        return (
            f"it would take {voxels} voxels, at most {MAX_VOXELS} are possible: thicken it in a mesh editor,"
        )
    return f"use voxels={voxels}"


def voxels_for_thinnest(report: MeshReport, voxel_size: float, voxels: int) -> int:
    """Number of voxels for which the thinnest parts are 2 voxels thick."""
    return enough_voxels(voxels, 2 * voxel_size / max(report.thinnest, 1e-6))


def warn(text: str) -> None:
    """Warn the caller of `SDF.from_mesh`."""
    warnings.warn(text, stacklevel=5)


def warn_of(report: MeshReport, voxel_size: float, voxels: int) -> None:
    """Warn the caller of `SDF.from_mesh` about repairs and thin parts."""
    if report.double_sided_faces:
        warn(f"mesh: {report.double_sided_faces} faces were double-sided; one side of each was kept")
    if report.inverted_parts:
        which = "it was" if report.parts == 1 else f"{report.inverted_parts} of its parts were"
        warn(f"mesh: {which} inside out; the faces were flipped outwards")
    if report.flipped_faces:
        warn(f"mesh: {report.flipped_faces} faces were oriented against their neighbours and were flipped")
    if report.thinnest < 2 * voxel_size:
        need = use_voxels(voxels_for_thinnest(report, voxel_size, voxels)).rstrip(",")
        warn(
            f"mesh: parts of it, {1e3 * report.thinnest:.2g} mm and less, are thinner than 2 voxels of "
            f"{1e3 * voxel_size:.2g} mm, and their surfaces will be inaccurate; {need}"
        )
