# SPDX-License-Identifier: MIT
"""Pose and size of solids and plane patches (thesis, section 3.8)."""

from sdftrack.primitives.fitting import fit_primitive
from sdftrack.primitives.frames import fit_primitives
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.tracked import Primitive

__all__ = ["Primitive", "PrimitiveFit", "fit_primitive", "fit_primitives"]
