# SPDX-License-Identifier: MIT
"""Signed distance volumes: creation from meshes and formulas, sampling, transforms, unions, rendering, files."""

from sdftrack.sdf.from_mesh import MeshReport
from sdftrack.sdf.unions import smooth_union, union
from sdftrack.sdf.volume import SDF

__all__ = ["SDF", "MeshReport", "smooth_union", "union"]
