# SPDX-License-Identifier: MIT
"""Track known shapes in depth and colour images, starting from a pose, a mask, a box, or a search."""

from sdftrack.tracking.tracker import Tracker

__all__ = ["Tracker"]
