# SPDX-License-Identifier: MIT
"""Triangle meshes and their files."""

from sdftrack.mesh.files import UNITS, unit_scale, vertex_colors
from sdftrack.mesh.mesh import Mesh, core_camera

__all__ = ["UNITS", "Mesh", "core_camera", "unit_scale", "vertex_colors"]
