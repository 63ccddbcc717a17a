# SPDX-License-Identifier: MIT
"""The measures. Importing this package enters them in `sdftrack.motion.definitions.DEFINITIONS`."""

from sdftrack.motion.measures import range_of_motion, smoothness, speed, tilt, timing

__all__ = ["range_of_motion", "smoothness", "speed", "tilt", "timing"]
