# SPDX-License-Identifier: MIT
"""Movement analysis: trajectories with covariance, smoothed, measured with 95 % intervals."""

from sdftrack.motion.analysis import Analysis, MeasuredRepetition, analyze
from sdftrack.motion.definitions import DEFINITIONS, Definition
from sdftrack.motion.files import load, save
from sdftrack.motion.filters import butterworth, resample, savitzky_golay
from sdftrack.motion.frames import at_point, in_frame, table_frame
from sdftrack.motion.intervals import Measured
from sdftrack.motion.posterior import SmoothedMotion
from sdftrack.motion.repetitions import Phase, Repetition, count_interval, find_repetitions
from sdftrack.motion.samples import MotionSamples
from sdftrack.motion.smoothing import smooth
from sdftrack.motion.trajectory import Trajectory

__all__ = [
    "DEFINITIONS",
    "Analysis",
    "Definition",
    "Measured",
    "MeasuredRepetition",
    "MotionSamples",
    "Phase",
    "Repetition",
    "SmoothedMotion",
    "Trajectory",
    "analyze",
    "at_point",
    "butterworth",
    "count_interval",
    "find_repetitions",
    "in_frame",
    "load",
    "resample",
    "save",
    "savitzky_golay",
    "smooth",
    "table_frame",
]
