# SPDX-License-Identifier: MIT
"""Synthetic sequences with exact ground truth: shapes, paths, noise, clutter, hands, colour, exercises."""

from sdftrack.synth.exercise import Exercise, exercise, exercise_sequence, load_exercise
from sdftrack.synth.grip import Grip
from sdftrack.synth.noise import Gaussian, Kinect, Stereo
from sdftrack.synth.objects import can_mesh, duck_mesh, exercise_object, turning_can
from sdftrack.synth.occluders import Cover, Hand
from sdftrack.synth.scene import sequence
from sdftrack.synth.surroundings import Table
from sdftrack.synth.trajectories import leave_and_return, orbit, random_walk, static, sweep

__all__ = [
    "Cover", "Exercise", "Gaussian", "Grip", "Hand", "Kinect", "Stereo", "Table", "can_mesh", "duck_mesh", "exercise",
    "exercise_object", "exercise_sequence", "leave_and_return", "load_exercise", "orbit", "random_walk", "sequence",
    "static", "sweep", "turning_can",
]  # fmt: skip
