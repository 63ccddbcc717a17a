# SPDX-License-Identifier: MIT
"""Two objects that are moved together, for example one in each hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Definition
from sdftrack.motion.intervals import Measured, measured
from sdftrack.motion.samples import MotionSamples

Array = NDArray[np.float64]
RATE_HZ = 50.0
LARGEST_LAG_S = 0.5
SHORTEST_S = 0.5  # a repetition whose part in the common time is shorter is left out


@dataclass(frozen=True, eq=False)
class Pair:
    """Measures of two objects over the repetitions of the first one.

    `start_s` to `end_s` is the time in which both were recorded, `note` a sentence about what was compared.
    """

    names: tuple[str, str]
    start_s: float
    end_s: float
    note: str
    values: list[tuple[Definition, Measured]]

    def to_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "objects": list(self.names), "start_s": self.start_s, "end_s": self.end_s, "note": self.note,
            "measures": [
                {**m.to_dict(), "label": d.label, "definition": d.text, "source": d.source} for d, m in self.values
            ],
        }  # fmt: skip


def _definition(name: str, label: str, unit: str, text: str, wide: float) -> Definition:
    source = "Distance and cross-correlation"
    return Definition(name, label, unit, text, source, wide, False, signed=name == "pair_lag")


DEFINITIONS = (
    _definition("pair_distance", "Distance", "m", "Mean distance between the points of the two objects.", 0.01),
    _definition(
        "pair_distance_range", "Change of the distance", "m",
        "Largest minus smallest distance between them in a repetition: 0 if they move as one.", 0.01,
    ),
    _definition(
        "pair_lag", "Lag", "s",
        "Time by which the speed of the second follows that of the first: the largest cross-correlation within 0.5 s.",
        0.2,
    ),
)  # fmt: skip


def pairs_of(analyses: Sequence[Analysis]) -> list[Pair]:
    """Every two objects of a recording; empty for one."""
    found = (_pair(a, b) for a, b in combinations(analyses, 2))
    return [p for p in found if p is not None]


def _pair(a: Analysis, b: Analysis) -> Pair | None:
    t, u = a.trajectory.times_s, b.trajectory.times_s
    start, end = max(t[0], u[0]), min(t[-1], u[-1])
    means, spreads = [], []
    for r in a.repetitions:
        low, high = max(r.span.start_s, start), min(r.span.end_s, end)
        if high - low < SHORTEST_S:
            continue
        # The second is needed before and after, too: it is shifted over the first.
        before, after = (int(min(LARGEST_LAG_S, m) * RATE_HZ) for m in (low - start, end - high))
        count = int((high - low) * RATE_HZ) + 1
        times = low + np.arange(-before, count + after) / RATE_HZ
        core = slice(before, before + count)
        first, second = a.motion.mean(times[core]), b.motion.mean(times)
        if not (first.observed.all() and second.observed.all()):
            continue
        means.append([v[0] for v in _values(first, second, core, 0)])
        spreads.append(_values(a.motion.samples(times[core]), b.motion.samples(times), core, 1))
    if not means:
        return None
    averages, spread = np.mean(means, axis=0), np.mean(spreads, axis=0)
    values = [(d, measured(d, float(v), s)) for d, v, s in zip(DEFINITIONS, averages, spread, strict=True)]
    names = a.trajectory.name, b.trajectory.name
    common = (
        "" if t[0] == u[0] and t[-1] == u[-1] else f", in the time that both have, {start:.1f} to {end:.1f} s"
    )
    note = f"Over {len(means)} repetitions of {names[0]} in which both are seen{common}."
    return Pair(names, float(start), float(end), note, values)


def _values(first: MotionSamples, second: MotionSamples, core: slice, shift: int) -> Array:
    """(3, S). `core`: the part of the second at the times of the first. Samples of the second are shifted by `shift`:
    those of both were drawn with the same random numbers."""
    positions = np.roll(second.positions_m[:, core], shift, axis=0)
    distance = np.linalg.norm(first.positions_m - positions, axis=-1)
    lag = _lag(first.speeds_mps, np.roll(second.speeds_mps, shift, axis=0), core.start)
    return np.array([distance.mean(axis=1), np.ptp(distance, axis=1), lag])


def _lag(first: Array, second: Array, before: int) -> Array:
    """(S,) time by which `second` follows `first`, to a fraction of a step by a parabola; NaN at the limit.

    Correlation coefficients of `first` with each part of `second` of its length: a sum of products would favour parts
    that contain more of the movement.
    """
    n = first.shape[1]
    a = first - first.mean(axis=1, keepdims=True)
    parts = np.lib.stride_tricks.sliding_window_view(second, n, axis=1)
    spread = np.sqrt(np.maximum((parts**2).mean(axis=-1) - parts.mean(axis=-1) ** 2, 1e-18))
    near = np.einsum("sn,skn->sk", a, parts) / spread
    if near.shape[1] < 3:
        return np.full(len(first), np.nan)
    k = near.argmax(axis=1)
    c = np.clip(k, 1, near.shape[1] - 2)
    rows = np.arange(len(near))
    low, peak, high = near[rows, c - 1], near[rows, c], near[rows, c + 1]
    bend = low - 2 * peak + high
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = np.where(bend < 0, 0.5 * (low - high) / bend, 0.0)
    return np.where(c == k, (c - before + fraction) / RATE_HZ, np.nan)
