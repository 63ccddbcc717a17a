# SPDX-License-Identifier: MIT
"""Shapes in two dimensions, and what they learn with."""

from sdftrack.contour.lwpr import LWPR

__all__ = ["LWPR"]
