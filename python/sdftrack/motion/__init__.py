# SPDX-License-Identifier: MIT
"""Movement analysis: trajectories with covariance, smoothed, measured with 95 % intervals."""

from sdftrack.motion.analysis import Analysis, MeasuredRepetition, analyze
from sdftrack.motion.definitions import DEFINITIONS, Definition
from sdftrack.motion.files import load, save
from sdftrack.motion.filters import butterworth, resample, savitzky_golay
from sdftrack.motion.frames import at_point, best_known_point, in_frame, table_frame
from sdftrack.motion.intervals import Measured
from sdftrack.motion.live import LiveMotion, LiveValues
from sdftrack.motion.measures.repeatability import dtw_distance, mean_dtw_distance
from sdftrack.motion.measures.smoothness import log_dimensionless_jerk, sparc
from sdftrack.motion.measures.targets import Box, Path, Sphere, parse_target
from sdftrack.motion.measures.tremor import Tremor, tremor_of
from sdftrack.motion.posterior import SmoothedMotion, smoothed_trajectory
from sdftrack.motion.repetitions import Phase, Repetition, count_interval, find_repetitions
from sdftrack.motion.samples import MotionSamples
from sdftrack.motion.smoothing import smooth
from sdftrack.motion.trajectory import Trajectory
from sdftrack.motion.two_objects import (
    Contacts,
    contact,
    contacts,
    surface_distances,
    symmetry,
    symmetry_index,
)

__all__ = [
    "DEFINITIONS",
    "Analysis",
    "Box",
    "Contacts",
    "Definition",
    "LiveMotion",
    "LiveValues",
    "Measured",
    "MeasuredRepetition",
    "MotionSamples",
    "Path",
    "Phase",
    "Repetition",
    "SmoothedMotion",
    "Sphere",
    "Trajectory",
    "Tremor",
    "analyze",
    "at_point",
    "best_known_point",
    "butterworth",
    "contact",
    "contacts",
    "count_interval",
    "dtw_distance",
    "find_repetitions",
    "in_frame",
    "load",
    "log_dimensionless_jerk",
    "mean_dtw_distance",
    "parse_target",
    "resample",
    "save",
    "savitzky_golay",
    "smooth",
    "smoothed_trajectory",
    "sparc",
    "surface_distances",
    "symmetry",
    "symmetry_index",
    "table_frame",
    "tremor_of",
]
