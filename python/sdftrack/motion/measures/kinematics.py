# SPDX-License-Identifier: MIT
"""Range of motion, tilt, speed and times of a movement, between movements and after a signal."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from sdftrack.motion.definitions import Context, measure, undefined
from sdftrack.motion.measures.movement import Movement, movement_of, moving
from sdftrack.motion.posterior import MotionSamples, with_rests
from sdftrack.motion.spline import angles_between

Array = NDArray[np.float64]


LARGEST_INDEX = 10.0  # a path that ends nearer to its start than a tenth of its length is closed, not crooked
DIRECTIONS = 36  # 5 degrees apart: the width in the nearest one is short by 0.1 % at most


def _steps(samples: MotionSamples) -> Array:
    """(S, n - 1) distances from sample to sample."""
    return np.asarray(np.linalg.norm(np.diff(samples.positions_m, axis=1), axis=-1))


@measure("path_length")
def path_length(samples: MotionSamples, context: Context) -> Array:
    within = moving(samples, context)
    return np.asarray((_steps(samples) * (within[1:] & within[:-1])).sum(axis=1))


@measure("index_of_curvature")
def index_of_curvature(samples: MotionSamples, context: Context) -> Array:
    within = movement_of(samples).within
    length = (_steps(samples) * (within[:, 1:] & within[:, :-1])).sum(axis=1)
    rows, n = np.arange(len(within)), within.shape[1]
    first, last = within.argmax(axis=1), n - 1 - within[:, ::-1].argmax(axis=1)
    distance = np.linalg.norm(samples.positions_m[rows, last] - samples.positions_m[rows, first], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        index = length / distance
    return np.where((length > 0) & (index <= LARGEST_INDEX), index, np.nan)


def _extent(axis: int, samples: MotionSamples, context: Context) -> Array:
    return np.asarray(np.ptp(samples.positions_m[:, :, axis], axis=1))


for _axis, _name in enumerate("xyz"):
    measure(f"range_{_name}")(partial(_extent, _axis))


@measure("range_height")
def range_height(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    return np.asarray(np.ptp(samples.positions_m @ context.up, axis=1))


@measure("range_horizontal")
def range_horizontal(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    side = np.linalg.svd(context.up[None])[2][1:]  # two directions that are perpendicular to it
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    directions = np.column_stack([np.cos(angles), np.sin(angles)]) @ side
    return np.asarray(np.max([np.ptp(samples.positions_m @ d, axis=1) for d in directions], axis=0))


@measure("reach")
def reach(samples: MotionSamples, context: Context) -> Array:
    moved = samples.positions_m - samples.positions_m[:, :1]
    return np.asarray(np.linalg.norm(moved, axis=-1).max(axis=1))


@measure("range_angle")
def range_angle(samples: MotionSamples, context: Context) -> Array:
    return np.asarray(angles_between(samples.rotations, samples.rotations[:, :1]).max(axis=1))


@measure("range_turn")
def range_turn(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    rate = samples.angular_velocities_radps @ context.up
    turned = np.cumsum(0.5 * (rate[:, 1:] + rate[:, :-1]), axis=1) / samples.rate_hz
    return np.asarray(np.maximum(turned.max(axis=1), 0) - np.minimum(turned.min(axis=1), 0))


def tilt(samples: MotionSamples, context: Context) -> Array:
    """(S, n) angle between the object's axis `axis_obj` and the vertical, rad."""
    assert context.up is not None
    axis = samples.rotations @ context.axis_obj
    # The arctangent is accurate near 0, where the arccosine is not.
    across = np.linalg.norm(np.cross(axis, context.up), axis=-1)
    return np.asarray(np.arctan2(across, axis @ context.up))


@measure("max_tilt")
def max_tilt(samples: MotionSamples, context: Context) -> Array:
    return undefined(samples) if context.up is None else np.asarray(tilt(samples, context).max(axis=1))


@measure("mean_tilt")
def mean_tilt(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    return np.asarray(tilt(samples, context)[:, moving(samples, context)].mean(axis=1))


PEAK_PART = 0.1  # prominence of a peak of the speed, as a part of the largest


@measure("peak_speed")
def peak_speed(samples: MotionSamples, context: Context) -> Array:
    return np.asarray(samples.speeds_mps.max(axis=1))


@measure("mean_speed")
def mean_speed(samples: MotionSamples, context: Context) -> Array:
    within = movement_of(samples).within
    count = within.sum(axis=1)
    return np.where(count > 0, (samples.speeds_mps * within).sum(axis=1) / np.maximum(count, 1), np.nan)


def _time_to_peak(samples: MotionSamples, movement: Movement) -> Array:
    speed = np.where(movement.within, samples.speeds_mps, -1)
    return np.asarray(samples.times_s[speed.argmax(axis=1)] - movement.onset_s)


@measure("time_to_peak_speed")
def time_to_peak_speed(samples: MotionSamples, context: Context) -> Array:
    return _time_to_peak(samples, movement_of(samples))


@measure("time_to_peak_speed_part")
def time_to_peak_speed_part(samples: MotionSamples, context: Context) -> Array:
    movement = movement_of(samples)
    duration = np.where(movement.duration_s > 0, movement.duration_s, np.nan)
    return 100 * _time_to_peak(samples, movement) / duration


@measure("velocity_peaks")
def velocity_peaks(samples: MotionSamples, context: Context) -> Array:
    within = movement_of(samples).within
    # Zeros on both sides make a maximum of a peak at the end of a movement that the repetition cuts.
    speeds = np.pad(samples.speeds_mps * within, ((0, 0), (1, 1)))
    # All rows at once: no prominence reaches below the zeros between two of them.
    peaks, found = find_peaks(speeds.ravel(), prominence=0)
    row, highest = peaks // speeds.shape[1], speeds.max(axis=1)
    counts = np.bincount(row[found["prominences"] >= PEAK_PART * highest[row]], minlength=len(speeds))
    return np.where(highest > 0, counts, np.nan)


@measure("peak_angular_speed")
def peak_angular_speed(samples: MotionSamples, context: Context) -> Array:
    turning = np.linalg.norm(samples.angular_velocities_radps, axis=-1)
    return np.asarray(np.where(moving(samples, context), turning, 0).max(axis=1))


@measure("peak_acceleration")
def peak_acceleration(samples: MotionSamples, context: Context) -> Array:
    return np.asarray(np.linalg.norm(samples.accelerations_mps2, axis=-1).max(axis=1))


@measure("movement_time")
def movement_time(samples: MotionSamples, context: Context) -> Array:
    return movement_of(samples).duration_s


@measure("repetition_time", beyond=True)
def repetition_time(samples: MotionSamples, context: Context) -> Array:
    onsets, offsets = _ends(samples, context)
    return offsets[:, -1] - onsets[:, 0]


@measure("dwell_time", beyond=True)
def dwell_time(samples: MotionSamples, context: Context) -> Array:
    onsets, offsets = _ends(samples, context)
    if onsets.shape[1] < 2:
        return undefined(samples)
    return np.asarray((onsets[:, 1:] - offsets[:, :-1]).sum(axis=1))


@measure("reaction_time", beyond=True)
def reaction_time(samples: MotionSamples, context: Context) -> Array:
    if context.cue_s is None:
        return undefined(samples)
    return np.asarray(_ends(samples, context)[0][:, 0] - context.cue_s)


def _ends(samples: MotionSamples, context: Context) -> tuple[Array, Array]:
    """(S, M) onsets and offsets of the M movements of the repetition."""
    movements = context.movements or ((context.start_s, context.end_s),)
    ends = []
    for k in range(len(movements)):
        part = samples.between(*with_rests(movements, k))
        if len(part.times_s) < 2 or not part.observed.all():
            ends.append((undefined(samples), undefined(samples)))
            continue
        found = movement_of(part)
        ends.append((found.onset_s, found.offset_s))
    onsets, offsets = np.moveaxis(np.array(ends), 0, -1)
    return onsets, offsets
