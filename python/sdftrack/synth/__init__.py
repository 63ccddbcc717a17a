# SPDX-License-Identifier: MIT
"""Synthetic sequences with exact ground truth: shapes, paths, noise, clutter, hands, colour, gaits, exercises."""

from sdftrack.synth.ball import BallScene, ball_scene
from sdftrack.synth.blob import BlobVideo, blob_video
from sdftrack.synth.covers import hide
from sdftrack.synth.duck import duck_mesh
from sdftrack.synth.exercise import Exercise, exercise
from sdftrack.synth.exercise_file import load_exercise
from sdftrack.synth.exercise_objects import exercise_object
from sdftrack.synth.exercise_sequence import exercise_sequence
from sdftrack.synth.gait import gait
from sdftrack.synth.gait_video import GaitVideo, gait_video
from sdftrack.synth.grip import Grip
from sdftrack.synth.noise import Gaussian, Kinect
from sdftrack.synth.occluders import Cover, Hand
from sdftrack.synth.printed_can import can_mesh, turning_can
from sdftrack.synth.region_picture import region_picture
from sdftrack.synth.room import corner
from sdftrack.synth.scene import sequence
from sdftrack.synth.standing import standing
from sdftrack.synth.stereo_noise import Stereo
from sdftrack.synth.surroundings import Table
from sdftrack.synth.table_scene import TableScene, table_scene
from sdftrack.synth.trajectories import leave_and_return, orbit, random_walk, static, sweep

__all__ = [
    "BallScene",
    "BlobVideo",
    "Cover",
    "Exercise",
    "GaitVideo",
    "Gaussian",
    "Grip",
    "Hand",
    "Kinect",
    "Stereo",
    "Table",
    "TableScene",
    "ball_scene",
    "blob_video",
    "can_mesh",
    "corner",
    "duck_mesh",
    "exercise",
    "exercise_object",
    "exercise_sequence",
    "gait",
    "gait_video",
    "hide",
    "leave_and_return",
    "load_exercise",
    "orbit",
    "random_walk",
    "region_picture",
    "sequence",
    "standing",
    "static",
    "sweep",
    "table_scene",
    "turning_can",
]
