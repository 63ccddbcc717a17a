# SPDX-License-Identifier: MIT
"""Synthetic sequences with exact truth: shapes, paths, sensor noise, clutter, a hand in front, colour."""

from sdftrack.synth.noise import Gaussian, Kinect
from sdftrack.synth.scene import sequence
from sdftrack.synth.trajectories import orbit, random_walk, static

__all__ = ["Gaussian", "Kinect", "orbit", "random_walk", "sequence", "static"]
