# SPDX-License-Identifier: MIT
"""Superpixel segmentation by simple linear iterative clustering (SLIC; thesis, appendix A)."""

from sdftrack.superpixels.regions import Regions, adjacency, boundaries, mark_boundaries, mean_colors, regions
from sdftrack.superpixels.segment import Video, slic

__all__ = ["Regions", "Video", "adjacency", "boundaries", "mark_boundaries", "mean_colors", "regions", "slic"]
