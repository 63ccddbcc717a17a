# SPDX-License-Identifier: MIT
"""Solids and plane patches of unknown size: where they are and how large (thesis, section 3.8)."""

from sdftrack.primitives.fitting import fit_primitive
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.scene import fit_primitives
from sdftrack.primitives.shape import Primitive

__all__ = ["Primitive", "PrimitiveFit", "fit_primitive", "fit_primitives"]
