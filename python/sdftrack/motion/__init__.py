# SPDX-License-Identifier: MIT
"""Movement analysis: trajectories with covariance, smoothed, measured with 95 % intervals."""

from sdftrack.motion.analysis import Analysis, MeasuredRepetition, analyze
from sdftrack.motion.definitions import DEFINITIONS, Definition, Measured
from sdftrack.motion.files import load, save
from sdftrack.motion.frames import (
    at_point,
    best_known_point,
    butterworth,
    in_frame,
    resample,
    savitzky_golay,
    table_frame,
)
from sdftrack.motion.live import LiveMotion, LiveValues
from sdftrack.motion.measures.repetitions import Tremor, dtw_distance, mean_dtw_distance, tremor_of
from sdftrack.motion.measures.smoothness import log_dimensionless_jerk, sparc
from sdftrack.motion.measures.targets import Box, Path, Sphere, parse_target
from sdftrack.motion.posterior import MotionSamples, SmoothedMotion, smoothed_trajectory
from sdftrack.motion.repetitions import Phase, Repetition, count_interval, find_repetitions
from sdftrack.motion.smoothing import smooth
from sdftrack.motion.trajectory import Trajectory
from sdftrack.motion.two_objects import contact, symmetry

__all__ = [
    "DEFINITIONS", "Analysis", "Box", "Definition", "LiveMotion", "LiveValues", "Measured", "MeasuredRepetition",
    "MotionSamples", "Path", "Phase", "Repetition", "SmoothedMotion", "Sphere", "Trajectory", "Tremor", "analyze",
    "at_point", "best_known_point", "butterworth", "contact", "count_interval", "dtw_distance", "find_repetitions",
    "in_frame", "load", "log_dimensionless_jerk", "mean_dtw_distance", "parse_target", "resample", "save",
    "savitzky_golay", "smooth", "smoothed_trajectory", "sparc", "symmetry", "table_frame", "tremor_of",
]  # fmt: skip
