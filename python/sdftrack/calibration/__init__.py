# SPDX-License-Identifier: MIT
"""Calibration of cameras from what they track."""
