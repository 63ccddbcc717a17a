# SPDX-License-Identifier: MIT
"""Repetitions of an exercise: the object leaves its place and comes back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from sdftrack._internal.validation import of_kind
from sdftrack.motion.excursion import Excursion, excursion_of, excursions_of_samples
from sdftrack.motion.posterior import SmoothedMotion
from sdftrack.motion.rests import Rests, rests_of

__all__ = ["Phase", "Repetition", "count_interval", "find_repetitions"]

Array = NDArray[np.float64]
PROMINENCE = 0.25  # of the largest excursion; smaller ones are hesitations
NEAR = 0.35  # of a repetition's excursion: rests below are at the place where it starts or ends
RATE_HZ = 50.0


@dataclass(frozen=True)
class Phase:
    """A stretch of a repetition: "move" (out, or there and back without a halt), "hold" or "return"; s."""

    name: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class Repetition:
    """From the start of the first movement to the end of the last one, s."""

    start_s: float
    end_s: float
    phases: tuple[Phase, ...] = ()

    def __post_init__(self) -> None:
        if not (np.isfinite([self.start_s, self.end_s]).all() and self.start_s < self.end_s):
            raise ValueError(f"repetition: expected start_s < end_s, got {self.start_s} and {self.end_s}")

    @property
    def movements(self) -> tuple[Phase, ...]:
        """The phases in which the object moves; without phases the whole repetition."""
        moving = tuple(p for p in self.phases if p.name != "hold")
        return moving or (Phase("move", self.start_s, self.end_s),)


def find_repetitions(
    motion: SmoothedMotion, *, by: str = "auto", spans_s: Sequence[tuple[float, float]] | None = None
) -> list[Repetition]:
    """Find the repetitions of an exercise and their phases.

    A repetition is an excursion from the place (or, `by` "rotation", the orientation) where the object is at first: a
    maximum of the distance from there that stands out by a quarter of the largest one. It starts and ends where the
    object rests, or, in a continuous movement such as drawing circles, where the distance is smallest.

    Parameters
    ----------
    motion : SmoothedMotion
    by : "auto", "position" or "rotation"
        "auto": position if the object moves by 30 mm or more.
    spans_s : list of (start, end), optional
        Repetitions set by hand; only their phases are found.

    Returns
    -------
    list of Repetition
        In order of time; empty if nothing moves.
    """
    of_kind(motion, SmoothedMotion, "motion")
    found = excursion_of(motion, RATE_HZ, by)
    if found is None and spans_s is None:
        return []
    rests = rests_of(motion, RATE_HZ)
    if spans_s is not None:
        spans = [(float(a), float(b)) for a, b in spans_s]
    else:
        assert found is not None
        spans = _spans(found, rests)
    return [Repetition(a, b, tuple(_phases(a, b, rests))) for a, b in spans]


def count_interval(motion: SmoothedMotion, *, by: str = "auto") -> tuple[int, int, int]:
    """The number of repetitions, and the 95 % interval of it over the samples of the posterior."""
    found = excursion_of(motion, RATE_HZ, by)
    if found is None:
        return 0, 0, 0
    counts = [len(_peaks(row, found)) for row in excursions_of_samples(motion, found)]
    low, high = np.percentile(counts, [2.5, 97.5])
    return len(_peaks(found.values, found)), int(np.floor(low)), int(np.ceil(high))


def _peaks(values: Array, found: Excursion) -> NDArray[np.int64]:
    prominence = PROMINENCE * found.largest
    # Of cycles about the start, a recording begins and ends between two extremes.
    if found.direction is not None:
        return np.asarray(find_peaks(values, prominence=prominence)[0])
    # Padded: an excursion that the recording cuts is one, too.
    padded = np.concatenate([[0.0], values, [0.0]])
    return np.asarray(find_peaks(padded, prominence=prominence)[0] - 1)


def _spans(found: Excursion, rests: Rests) -> list[tuple[float, float]]:
    """Start and end of the excursion about each peak."""
    e, t = found.values, found.times_s
    peaks = _peaks(e, found)
    valleys = [
        0,
        *(a + int(np.argmin(e[a : b + 1])) for a, b in pairwise(peaks)),
        len(e) - 1,
    ]
    spans = []
    for k, peak in enumerate(peaks):
        left, right = valleys[k], valleys[k + 1]
        start = _edge(e, t, rests, peak, left, before=True)
        end = _edge(e, t, rests, peak, right, before=False)
        if end > start:
            spans.append((start, end))
    return spans


def _edge(e: Array, t: Array, rests: Rests, peak: int, valley: int, before: bool) -> float:
    """Where the movement about `peak` leaves the rest at `valley`, or `valley` itself if the object does not rest."""
    near = e[valley] + NEAR * (e[peak] - e[valley])
    low, high = min(t[valley], t[peak]), max(t[valley], t[peak])
    for start, end in reversed(rests.spans) if before else rests.spans:
        at = end if before else start
        if low - 1e-9 <= at <= high + 1e-9 and e[min(int(np.searchsorted(t, at)), len(e) - 1)] <= near:
            return at
    return float(t[valley])


def _phases(start: float, end: float, rests: Rests) -> list[Phase]:
    """Movements and the holds between them; the last movement is the return if there was a hold."""
    holds = [(max(a, start), min(b, end)) for a, b in rests.spans if a > start + 1e-9 and b < end - 1e-9]
    if not holds:
        return [Phase("move", start, end)]
    phases, at = [], start
    for a, b in holds:
        phases += [Phase("move", at, a), Phase("hold", a, b)]
        at = b
    return [*phases, Phase("return", at, end)]
