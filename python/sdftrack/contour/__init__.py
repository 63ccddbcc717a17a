# SPDX-License-Identifier: MIT
"""Outlines in plain colour video: cosine series of silhouettes, and a memory that recovers hidden parts."""

from sdftrack.contour.assessment import Assessment
from sdftrack.contour.dct import harmonics, silhouette
from sdftrack.contour.masks import align
from sdftrack.contour.memory import ShapeMemory

__all__ = ["Assessment", "ShapeMemory", "align", "harmonics", "silhouette"]
