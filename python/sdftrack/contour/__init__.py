# SPDX-License-Identifier: MIT
"""Deforming objects in colour video, by their outline."""

from sdftrack.contour.tracker import ContourResult, ContourTracker

__all__ = ["ContourResult", "ContourTracker"]
