# SPDX-License-Identifier: MIT
"""Calibrate a depth camera with what is at hand: its intrinsics by a known object, its colour camera by a ball."""

from sdftrack.calibration.intrinsics import calibrate_intrinsics
from sdftrack.calibration.intrinsics_result import IntrinsicsResult

__all__ = ["IntrinsicsResult", "calibrate_intrinsics"]
