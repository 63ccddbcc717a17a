# SPDX-License-Identifier: MIT
"""Trajectory files: result folders, TUM, BOP, C3D and CSV are read; CSV, C3D, OpenSim's STO and TRC are written."""

from sdftrack.motion.files.load import load
from sdftrack.motion.files.save import save

__all__ = ["load", "save"]
