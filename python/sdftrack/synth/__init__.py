# SPDX-License-Identifier: MIT
"""Synthetic sequences with exact truth: shapes, paths, sensor noise, clutter, hands in front, colour, gaits."""

from sdftrack.synth.ball import BallScene, ball_scene
from sdftrack.synth.covers import hide
from sdftrack.synth.gait import gait
from sdftrack.synth.gait_video import GaitVideo, gait_video
from sdftrack.synth.grip import Grip
from sdftrack.synth.noise import Gaussian, Kinect
from sdftrack.synth.occluders import Cover, Hand
from sdftrack.synth.room import corner
from sdftrack.synth.scene import sequence
from sdftrack.synth.trajectories import leave_and_return, orbit, random_walk, static, sweep

__all__ = [
    "BallScene",
    "Cover",
    "GaitVideo",
    "Gaussian",
    "Grip",
    "Hand",
    "Kinect",
    "ball_scene",
    "corner",
    "gait",
    "gait_video",
    "hide",
    "leave_and_return",
    "orbit",
    "random_walk",
    "sequence",
    "static",
    "sweep",
]
