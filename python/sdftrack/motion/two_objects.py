# SPDX-License-Identifier: MIT
"""Two objects, for example one in each hand: moved together, contact of their surfaces, symmetry of their measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import number, numbers, of_kind
from sdftrack.motion.analysis import Analysis
from sdftrack.motion.definitions import Definition, Measured, measured
from sdftrack.motion.measures.targets import beginnings, settled
from sdftrack.motion.posterior import MotionSamples
from sdftrack.sdf import SDF

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


PAIRS = (
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
    values = [(d, measured(d, float(v), s)) for d, v, s in zip(PAIRS, averages, spread, strict=True)]
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
    """(S,) time by which `second` follows `first`, to a fraction of a step by a parabola; NaN at the limit."""
    # Correlation coefficients of `first` with each part of `second` of its length: a sum of products would favour parts
    # that contain more of the movement.
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


# -- Contact of the surfaces, and symmetry


CONTACT_RATE_HZ = 30.0
SAMPLES = 40  # of the posterior: each of them asks the distances of all points
MOST_POINTS = 500
CONTACTS = tuple(
    Definition(name, name, unit, text, "", wide, False, signed=name == "surface_distance")
    for name, unit, text, wide in (
        ("surface_distance", "m", "Smallest distance of the surfaces.", 0.01),
        ("contact_time", "s", "Time with a smaller distance than the threshold.", 0.5),
        ("contacts", "1", "Number of contacts.", 1.5),
    )
)


def contact(
    first: Analysis, second: Analysis, shape: Any, points_m: ArrayLike, *, threshold_m: float = 0.003
) -> dict[str, Measured]:
    """Distance of the surfaces of two objects and the time that they touch.

    Parameters
    ----------
    first, second : Analysis
        Of the same recording.
    shape : SDF
        Of the first object, in the frame of its trajectory.
    points_m : (K, 3) array
        Points of the second object's surface, for example its mesh's vertices, in the frame of its trajectory; of more
        than 500 every k-th is used.
    threshold_m : float
        Surfaces that are nearer touch. No less than the error of the positions tells contact from nearness.

    Returns
    -------
    dict of str to Measured
        "surface_distance" (smallest, m, below 0 where they penetrate), "contact_time" (s) and "contacts" (number, those
        and the gaps between them of 0.1 s and more).

    Raises
    ------
    TypeError, ValueError
        Other arguments, or no time in common.
    """
    of_kind(first, Analysis, "first")
    of_kind(second, Analysis, "second")
    points = numbers(points_m, "points_m")
    if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
        raise ValueError(f"points_m: expected points (K, 3), finite, at least one, got shape {points.shape}")
    near = number(threshold_m, "threshold_m")
    points = points[:: -(-len(points) // MOST_POINTS)]
    t, u = first.trajectory.times_s, second.trajectory.times_s
    start, end = max(t[0], u[0]), min(t[-1], u[-1])
    if end - start < 1 / CONTACT_RATE_HZ:
        raise ValueError(
            f"second: expected a trajectory of the same time, {t[0]:g} to {t[-1]:g} s, got {u[0]:g} to {u[-1]:g} s"
        )
    times = np.arange(start, end, 1 / CONTACT_RATE_HZ)
    mean = _touches(first.motion.mean(times), second.motion.mean(times), shape, points, near)
    # The samples of two objects are drawn alike, and their errors are not: those of the second are shifted.
    drawn = [x.motion.samples(times) for x in (first, second)]
    count = min(SAMPLES, *(len(d.positions_m) - 1 for d in drawn))
    a, b = (d.part(slice(k, k + count), slice(None)) for k, d in enumerate(drawn))
    each = _touches(a, b, shape, points, near)
    every = zip(CONTACTS, mean, each, strict=True)
    return {d.name: measured(d, float(at_mean[0]), sampled) for d, at_mean, sampled in every}


def symmetry(left: Analysis, right: Analysis) -> dict[str, Measured]:
    """Symmetry of two hands or of two objects: the difference of each average over its mean, in percent.

    200 (L - R) / |L + R|: 0 where both are alike, above 0 where the left is larger (Robinson, Herzog and Nigg 1987,
    Journal of Manipulative and Physiological Therapeutics 10:172-176, who write right minus left). Measures that are
    undefined, 0 in both or of different signs are left out. The intervals are those of the averages, propagated to
    first order.
    """
    of_kind(left, Analysis, "left")
    of_kind(right, Analysis, "right")
    out = {}
    for name, a in left.averages.items():
        b = right.averages.get(name)
        if b is None or not np.isfinite([a.value, b.value]).all():
            continue
        total = a.value + b.value
        if total == 0 or a.value * b.value < 0:
            continue
        value = 100 * ((a.value - b.value) / (0.5 * abs(total)))
        half_a, half_b = 0.5 * (a.high - a.low), 0.5 * (b.high - b.low)
        half = 400 / total**2 * float(np.hypot(b.value * half_a, a.value * half_b))
        fine = a.determined and b.determined
        out[name] = Measured(name, "%", value, value - half, value + half, fine, a.note or b.note)
    return out


def _touches(a: MotionSamples, b: MotionSamples, shape: SDF, points: Array, near: float) -> tuple[Array, ...]:
    """Smallest distance, time of contact and number of contacts, (S,) each; gaps of either count as apart."""
    # The distance is that of a's volume at points of b's surface: exact within the volume, for dense points.
    seen = a.observed & b.observed
    distances = np.full(a.positions_m.shape[:2], np.inf)
    for s in range(len(distances)):  # one sample at a time: all points at all times of all samples are many
        to_a = np.swapaxes(a.rotations[s, seen], 1, 2)
        R = to_a @ b.rotations[s, seen]  # R_a_b
        t = to_a @ (b.positions_m - a.positions_m)[s, seen][..., None]
        distances[s, seen] = shape((R @ points.T + t).swapaxes(1, 2)).min(axis=1)
    touch = settled(distances <= near, a.rate_hz)
    return distances.min(axis=1), touch.sum(axis=1) / CONTACT_RATE_HZ, beginnings(touch).sum(axis=1)
