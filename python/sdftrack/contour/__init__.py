# SPDX-License-Identifier: MIT
"""Two-dimensional shapes: contour tracking in video, a memory of silhouettes, and regression."""

from sdftrack.contour.dct import align, harmonics, signed_distances, silhouette
from sdftrack.contour.drawing import draw_outline
from sdftrack.contour.lwpr import LWPR
from sdftrack.contour.memory import ShapeMemory
from sdftrack.contour.result import Assessment, ContourResult
from sdftrack.contour.tracker import ContourTracker

__all__ = [
    "LWPR", "Assessment", "ContourResult", "ContourTracker", "ShapeMemory", "align", "draw_outline", "harmonics",
    "signed_distances", "silhouette",
]  # fmt: skip
