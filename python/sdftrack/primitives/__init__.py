# SPDX-License-Identifier: MIT
"""Pose and size of solids and plane patches (thesis, section 3.8)."""

from sdftrack.primitives.fitting import fit_primitive
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.scene import fit_primitives
from sdftrack.primitives.shape import Primitive

__all__ = ["Primitive", "PrimitiveFit", "fit_primitive", "fit_primitives"]
