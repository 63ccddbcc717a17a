# SPDX-License-Identifier: MIT
"""Speed: peak, mean, when and how many peaks; angular speed and acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from sdftrack.motion.definitions import Context, measure
from sdftrack.motion.measures.movement import Movement, movement_of, moving
from sdftrack.motion.samples import MotionSamples

Array = NDArray[np.float64]
CORE_SET = "Schwarz et al. 2022, doi 10.1186/s12984-021-00979-0"
PEAK_PART = 0.1  # prominence of a peak of the speed, as a part of the largest


@measure(
    "peak_speed",
    "Peak speed",
    "m/s",
    "Largest norm of the velocity of the point.",
    CORE_SET,
    part=0.2,
    of="movement",
)
def peak_speed(samples: MotionSamples, context: Context) -> Array:
    return np.asarray(samples.speeds_mps.max(axis=1))


@measure(
    "mean_speed",
    "Mean speed",
    "m/s",
    "Mean of the norm of the velocity of the point over the samples from onset to offset.",
    CORE_SET,
    part=0.2,
    of="movement",
)
def mean_speed(samples: MotionSamples, context: Context) -> Array:
    within = movement_of(samples).within
    count = within.sum(axis=1)
    return np.where(count > 0, (samples.speeds_mps * within).sum(axis=1) / np.maximum(count, 1), np.nan)


def _time_to_peak(samples: MotionSamples, movement: Movement) -> Array:
    speed = np.where(movement.within, samples.speeds_mps, -1)
    return np.asarray(samples.times_s[speed.argmax(axis=1)] - movement.onset_s)


@measure(
    "time_to_peak_speed",
    "Time to peak speed",
    "s",
    "Time from onset to the sample with the largest speed between onset and offset.",
    CORE_SET,
    wide=0.2,
    of="movement",
)
def time_to_peak_speed(samples: MotionSamples, context: Context) -> Array:
    return _time_to_peak(samples, movement_of(samples))


@measure(
    "time_to_peak_speed_part",
    "Time to peak speed, part of movement time",
    "%",
    "Time from onset to the sample with the largest speed between onset and offset, in percent of the movement time: "
    "50 for a minimum-jerk movement.",
    CORE_SET,
    wide=20,
    of="movement",
)
def time_to_peak_speed_part(samples: MotionSamples, context: Context) -> Array:
    movement = movement_of(samples)
    duration = np.where(movement.duration_s > 0, movement.duration_s, np.nan)
    return 100 * _time_to_peak(samples, movement) / duration


@measure(
    "velocity_peaks",
    "Number of velocity peaks",
    "1",
    "Number of local maxima of the speed between onset and offset with a prominence of at least 10 % of the largest "
    "speed there: 1 for a minimum-jerk movement.",
    f"{CORE_SET}; number of peaks in Mohamed Refai et al. 2021, doi 10.1186/s12984-021-00949-6",
    wide=2,
    of="movement",
)
def velocity_peaks(samples: MotionSamples, context: Context) -> Array:
    within = movement_of(samples).within
    # Zeros on both sides make a maximum of a peak at the end of a movement that the repetition cuts.
    speeds = np.pad(samples.speeds_mps * within, ((0, 0), (1, 1)))
    # All rows at once: no prominence reaches below the zeros between two of them.
    peaks, found = find_peaks(speeds.ravel(), prominence=0)
    row, highest = peaks // speeds.shape[1], speeds.max(axis=1)
    counts = np.bincount(row[found["prominences"] >= PEAK_PART * highest[row]], minlength=len(speeds))
    return np.where(highest > 0, counts, np.nan)


@measure(
    "peak_angular_speed",
    "Peak angular speed",
    "rad/s",
    "Largest norm of the angular velocity of the object in the movements of the repetition.",
    "Norm of the angular velocity of a rigid body",
    part=0.2,
)
def peak_angular_speed(samples: MotionSamples, context: Context) -> Array:
    turning = np.linalg.norm(samples.angular_velocities_radps, axis=-1)
    return np.asarray(np.where(moving(samples, context), turning, 0).max(axis=1))


@measure(
    "peak_acceleration",
    "Peak acceleration",
    "m/s^2",
    "Largest norm of the acceleration of the point, without gravity.",
    "Norm of the second derivative of the position",
    part=0.3,
    of="movement",
)
def peak_acceleration(samples: MotionSamples, context: Context) -> Array:
    return np.asarray(np.linalg.norm(samples.accelerations_mps2, axis=-1).max(axis=1))
