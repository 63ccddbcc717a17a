# SPDX-License-Identifier: MIT
"""Track known shapes in depth and colour images, from a pose, a mask, a box or nothing but the shape."""

from sdftrack.tracking.tracker import Tracker

__all__ = ["Tracker"]
