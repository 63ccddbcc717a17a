# SPDX-License-Identifier: MIT
"""``sdftrack calibrate``: camera calibration from recordings."""

from sdftrack.cli.calibrate.color import color
from sdftrack.cli.calibrate.depth import depth
from sdftrack.cli.calibrate.intrinsics import intrinsics

__all__ = ["color", "depth", "intrinsics"]
