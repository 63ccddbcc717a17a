# SPDX-License-Identifier: MIT
"""Deforming objects in colour video, by their outline; and the regression that remembers shapes."""

from sdftrack.contour.lwpr import LWPR
from sdftrack.contour.tracker import ContourResult, ContourTracker

__all__ = ["LWPR", "ContourResult", "ContourTracker"]
