# SPDX-License-Identifier: MIT
"""Contour tracking and the memory of shapes."""
