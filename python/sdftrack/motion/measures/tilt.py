# SPDX-License-Identifier: MIT
"""Tilt of a carried vessel against gravity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Context, measure, undefined
from sdftrack.motion.measures.movement import moving
from sdftrack.motion.samples import MotionSamples

Array = NDArray[np.float64]
SOURCE = "Angle between two directions"


def tilt(samples: MotionSamples, context: Context) -> Array:
    """(S, n) angle between the object's axis `axis_obj` and the vertical, rad."""
    assert context.up is not None
    axis = samples.rotations @ context.axis_obj
    # The arctangent is accurate near 0, where the arccosine is not.
    across = np.linalg.norm(np.cross(axis, context.up), axis=-1)
    return np.asarray(np.arctan2(across, axis @ context.up))


@measure(
    "max_tilt",
    "Largest tilt",
    "rad",
    "Largest angle between the object's upright axis and the vertical in the repetition; undefined without the "
    "direction of gravity.",
    SOURCE,
    wide=0.1,
)
def max_tilt(samples: MotionSamples, context: Context) -> Array:
    return undefined(samples) if context.up is None else np.asarray(tilt(samples, context).max(axis=1))


@measure(
    "mean_tilt",
    "Mean tilt while carried",
    "rad",
    "Mean angle between the object's upright axis and the vertical over the movements of the repetition; undefined "
    "without the direction of gravity.",
    SOURCE,
    wide=0.1,
)
def mean_tilt(samples: MotionSamples, context: Context) -> Array:
    if context.up is None:
        return undefined(samples)
    return np.asarray(tilt(samples, context)[:, moving(samples, context)].mean(axis=1))
