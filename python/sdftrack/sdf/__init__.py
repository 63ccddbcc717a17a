# SPDX-License-Identifier: MIT
"""Signed distance volumes: from meshes and formulas, sampled, moved, joined, rendered, saved."""

from sdftrack.sdf.mesh_report import MeshReport
from sdftrack.sdf.unions import smooth_union, union
from sdftrack.sdf.volume import SDF

__all__ = ["SDF", "MeshReport", "smooth_union", "union"]
