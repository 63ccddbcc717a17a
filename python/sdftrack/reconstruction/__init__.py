# SPDX-License-Identifier: MIT
"""Reconstruct an unknown object while it is tracked (thesis, chapter 4)."""

from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.reconstruction.quality import Quality
from sdftrack.reconstruction.reconstructor import Reconstructor

__all__ = ["Quality", "Reconstructor", "ReconstructorOptions"]
