# SPDX-License-Identifier: MIT
"""Movement analysis: trajectories with covariance, smoothed, measured with 95 % intervals."""

from sdftrack.motion.posterior import SmoothedMotion
from sdftrack.motion.samples import MotionSamples
from sdftrack.motion.smoothing import smooth
from sdftrack.motion.trajectory import Trajectory

__all__ = ["MotionSamples", "SmoothedMotion", "Trajectory", "smooth"]
