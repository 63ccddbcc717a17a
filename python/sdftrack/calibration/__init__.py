# SPDX-License-Identifier: MIT
"""Camera calibration with simple objects: a depth camera by a known object, its colour camera by a ball."""
