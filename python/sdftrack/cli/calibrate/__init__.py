# SPDX-License-Identifier: MIT
"""``sdftrack calibrate``: camera calibration from recordings."""
