# SPDX-License-Identifier: MIT
"""Shapes in two dimensions: cosine series of silhouettes, a memory that recovers hidden parts, and its regression."""

from sdftrack.contour.assessment import Assessment
from sdftrack.contour.dct import harmonics, silhouette
from sdftrack.contour.lwpr import LWPR
from sdftrack.contour.masks import align
from sdftrack.contour.memory import ShapeMemory

__all__ = ["LWPR", "Assessment", "ShapeMemory", "align", "harmonics", "silhouette"]
