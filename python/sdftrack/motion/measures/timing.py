# SPDX-License-Identifier: MIT
"""Times: of a movement, between movements, and after a signal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.definitions import Context, measure, undefined
from sdftrack.motion.measures.movement import movement_of
from sdftrack.motion.samples import MotionSamples, with_rests

Array = NDArray[np.float64]
CORE_SET = "Schwarz et al. 2022, doi 10.1186/s12984-021-00979-0"


@measure(
    "movement_time",
    "Movement time",
    "s",
    "Time from onset to offset: where the speed, searched from its peak outward, falls below 5 % of the peak for "
    "0.1 s.",
    CORE_SET,
    part=0.2,
    of="movement",
)
def movement_time(samples: MotionSamples, context: Context) -> Array:
    return movement_of(samples).duration_s


@measure(
    "repetition_time",
    "Time of the repetition",
    "s",
    "Time from the onset of the first movement of the repetition to the offset of the last one.",
    CORE_SET,
    part=0.2,
    beyond=True,
)
def repetition_time(samples: MotionSamples, context: Context) -> Array:
    onsets, offsets = _ends(samples, context)
    return offsets[:, -1] - onsets[:, 0]


@measure(
    "dwell_time",
    "Dwell time",
    "s",
    "Time between the movements of a repetition: from the offset of each of them to the onset of the next one, added "
    "up; undefined without a hold.",
    CORE_SET,
    part=0.2,
    beyond=True,
)
def dwell_time(samples: MotionSamples, context: Context) -> Array:
    onsets, offsets = _ends(samples, context)
    if onsets.shape[1] < 2:
        return undefined(samples)
    return np.asarray((onsets[:, 1:] - offsets[:, :-1]).sum(axis=1))


@measure(
    "reaction_time",
    "Reaction time",
    "s",
    "Time from the signal to the onset of the first movement of the object, so with the reach of the hand to it; "
    "undefined without a signal.",
    CORE_SET,
    wide=0.1,
    beyond=True,
)
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
