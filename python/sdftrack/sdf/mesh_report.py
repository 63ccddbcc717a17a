# SPDX-License-Identifier: MIT
"""Report on a mesh before its conversion to a volume."""

from __future__ import annotations

from dataclasses import dataclass


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
