# SPDX-License-Identifier: MIT
"""The measures. Importing this package enters them in `sdftrack.motion.definitions.DEFINITIONS`."""

from sdftrack.motion.measures import path, range_of_motion, smoothness, speed, tilt, timing

__all__ = ["path", "range_of_motion", "smoothness", "speed", "tilt", "timing"]
