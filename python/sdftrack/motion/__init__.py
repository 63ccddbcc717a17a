# SPDX-License-Identifier: MIT
"""Movement analysis: trajectories with covariance, smoothed, measured with 95 % intervals."""

from sdftrack.motion.files import load, save
from sdftrack.motion.samples import MotionSamples
from sdftrack.motion.trajectory import Trajectory

__all__ = ["MotionSamples", "Trajectory", "load", "save"]
