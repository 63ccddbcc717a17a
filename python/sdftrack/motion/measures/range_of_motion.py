# SPDX-License-Identifier: MIT
"""Range of motion: of the position along axes and in the horizontal plane, and of the orientation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Context, measure, undefined
from sdftrack.motion.measures.movement import movement_of, moving
from sdftrack.motion.quaternion_curves import angles_between
from sdftrack.motion.samples import MotionSamples

Array = NDArray[np.float64]


CORE_SET = "Schwarz et al. 2022, doi 10.1186/s12984-021-00979-0"
LARGEST_INDEX = 10.0  # a path that ends nearer to its start than a tenth of its length is closed, not crooked
DIRECTIONS = 36  # 5 degrees apart: the width in the nearest one is short by 0.1 % at most


def _steps(samples: MotionSamples) -> Array:
    """(S, n - 1) distances from sample to sample."""
    return np.asarray(np.linalg.norm(np.diff(samples.positions_m, axis=1), axis=-1))


@measure(
    "path_length",
    "Path length",
    "m",
    "Sum of the distances between consecutive positions (100 Hz) of the point in the movements of the repetition; "
    "rests and holds are left out, in which only noise and tremor would be added up.",
    CORE_SET,
    part=0.2,
)
def path_length(samples: MotionSamples, context: Context) -> Array:
    within = moving(samples, context)
    return np.asarray((_steps(samples) * (within[1:] & within[:-1])).sum(axis=1))


@measure(
    "index_of_curvature",
    "Index of curvature",
    "1",
    "Path length from onset to offset divided by the distance between the positions at onset and offset: 1 for a "
    "straight line; undefined above 10 (a path that returns) and where nothing moves.",
    "Index of curvature in Mohamed Refai et al. 2021, doi 10.1186/s12984-021-00949-6",
    part=0.2,
    of="movement",
)
def index_of_curvature(samples: MotionSamples, context: Context) -> Array:
    within = movement_of(samples).within
    length = (_steps(samples) * (within[:, 1:] & within[:, :-1])).sum(axis=1)
    rows, n = np.arange(len(within)), within.shape[1]
    first, last = within.argmax(axis=1), n - 1 - within[:, ::-1].argmax(axis=1)
    distance = np.linalg.norm(samples.positions_m[rows, last] - samples.positions_m[rows, first], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        index = length / distance
    return np.where((length > 0) & (index <= LARGEST_INDEX), index, np.nan)


def _along(axis: int) -> Callable[[MotionSamples, Context], Array]:
    def extent(samples: MotionSamples, context: Context) -> Array:
        return np.asarray(np.ptp(samples.positions_m[:, :, axis], axis=1))

    return extent


for _k, _name in enumerate("xyz"):
    measure(
        f"range_{_name}",
        f"Range along {_name}",
        "m",
        f"Largest minus smallest {_name} of the point in the repetition, in the reference frame.",
        CORE_SET,
        wide=0.02,
    )(_along(_k))


@measure(
    "range_height",
    "Range of height",
    "m",
    "Largest minus smallest height of the point against gravity in the repetition; undefined without its direction.",
    CORE_SET,
    wide=0.02,
)
def range_height(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    return np.asarray(np.ptp(samples.positions_m @ context.up, axis=1))


@measure(
    "range_horizontal",
    "Horizontal range",
    "m",
    "Largest extent of the path in a horizontal direction, of 36 directions 5 degrees apart; undefined without the "
    "direction of gravity.",
    CORE_SET,
    wide=0.02,
)
def range_horizontal(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    side = np.linalg.svd(context.up[None])[2][1:]  # two directions that are perpendicular to it
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    directions = np.column_stack([np.cos(angles), np.sin(angles)]) @ side
    return np.asarray(np.max([np.ptp(samples.positions_m @ d, axis=1) for d in directions], axis=0))


@measure(
    "reach",
    "Reach",
    "m",
    "Largest distance of the point from its place at the start of the repetition.",
    CORE_SET,
    wide=0.02,
)
def reach(samples: MotionSamples, context: Context) -> Array:
    moved = samples.positions_m - samples.positions_m[:, :1]
    return np.asarray(np.linalg.norm(moved, axis=-1).max(axis=1))


@measure(
    "range_angle",
    "Range of rotation",
    "rad",
    "Largest angle of the rotation from the orientation at the start of the repetition.",
    "Angle of a rotation: arccos((trace R - 1) / 2)",
    wide=0.1,
)
def range_angle(samples: MotionSamples, context: Context) -> Array:
    return np.asarray(angles_between(samples.rotations, samples.rotations[:, :1]).max(axis=1))


@measure(
    "range_turn",
    "Range of turning",
    "rad",
    "Largest minus smallest angle turned about the vertical: the integral of the angular velocity's part along it; "
    "undefined without the direction of gravity.",
    CORE_SET,
    wide=0.1,
)
def range_turn(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    rate = samples.angular_velocities_radps @ context.up
    turned = np.cumsum(0.5 * (rate[:, 1:] + rate[:, :-1]), axis=1) / samples.rate_hz
    return np.asarray(np.maximum(turned.max(axis=1), 0) - np.minimum(turned.min(axis=1), 0))
