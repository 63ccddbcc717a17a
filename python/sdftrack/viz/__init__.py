# SPDX-License-Identifier: MIT
"""Pictures: overlays on frames (numpy and OpenCV), plots (matplotlib)."""

from sdftrack.viz.overlay import draw

__all__ = ["draw"]
