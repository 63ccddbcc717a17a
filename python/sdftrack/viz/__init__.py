# SPDX-License-Identifier: MIT
"""Visualisation: overlays on frames (numpy and OpenCV), plots (matplotlib), a page in the browser (viser)."""

from sdftrack.viz.overlay import draw

__all__ = ["draw"]
