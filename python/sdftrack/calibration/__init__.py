# SPDX-License-Identifier: MIT
"""Calibrate cameras with what is at hand: a depth camera by a known object, its colour camera by a ball."""
