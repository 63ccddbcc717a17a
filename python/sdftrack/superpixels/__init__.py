# SPDX-License-Identifier: MIT
"""Superpixels: an image cut into small regions of one colour, by simple linear iterative clustering (appendix A)."""

from sdftrack.superpixels.regions import Regions, adjacency, boundaries, mark_boundaries, mean_colors, regions
from sdftrack.superpixels.segment import Video, slic

__all__ = ["Regions", "Video", "adjacency", "boundaries", "mark_boundaries", "mean_colors", "regions", "slic"]
