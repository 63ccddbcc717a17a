# SPDX-License-Identifier: MIT
"""Which images of two folders or streams belong together: by name, number, time or order; the unit of their times."""

from __future__ import annotations

import itertools
import re
import warnings
from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.frame import Frame

MOST_GAPS = 0.34  # of the steps between numbers: with more, they are chosen images, and none is missing
SHOWN = 5  # numbers in a message
STAMP_DIGITS = 13  # of a whole number that is a time: milliseconds since 1970
_TIME = re.compile(r"\D*(\d+\.\d+)")
_REDWOOD = re.compile(r"\d+-(\d+)")  # number-microseconds


def labels(files: Sequence[Path]) -> list[str]:
    """The names of images without the suffix; with that of their folder, where each has a folder of its own."""
    stems = [file.stem for file in files]
    alike = len(stems) > 1 and len(set(stems)) == 1
    return [f"{file.parent.name}/{file.stem}" for file in files] if alike else stems


def frame_numbers(files: Sequence[Path]) -> list[int] | None:
    """The number that counts the images, of their names; None if no number tells them apart, or it is a time."""
    found = [re.findall(r"\d+", label) for label in labels(files)]
    if not found or len({len(numbers) for numbers in found}) != 1 or times_in_names(files) is not None:
        return None
    columns = [[int(number) for number in column] for column in zip(*found, strict=True)]
    best = max(columns, key=lambda column: len(set(column)), default=None)
    return best if best is not None and (len(set(best)) > 1 or len(best) == 1) else None


def times_in_names(files: Sequence[Path]) -> list[float] | list[int] | None:
    """The times that are the names of images, in the unit that they have; None if not all are times."""
    decimal = [_TIME.fullmatch(file.stem) for file in files]
    if decimal and all(decimal):
        return [float(m[1]) for m in decimal if m]
    stamps = [re.fullmatch(r"\D*(\d+)", file.stem) for file in files]
    if stamps and all(m and len(m[1]) >= STAMP_DIGITS for m in stamps):
        return [int(m[1]) for m in stamps if m]
    return None


def times_of(files: Sequence[Path], name: str) -> NDArray[np.float64] | None:
    redwood = [_REDWOOD.fullmatch(file.stem) for file in files]
    if redwood and all(redwood):
        return np.array([1e-6 * int(m[1]) for m in redwood if m])
    times = times_in_names(files)
    return None if times is None else in_seconds(times, name)


def paired(depth: Sequence[Path], others: Sequence[Path], what: str = "colour images") -> list[Path | None]:
    """For each depth image the one of `others` that belongs to it, or None. By the way that pairs the most: equal
    names, equal numbers in the names, times in the names at most half a period apart, and last, if there are as many,
    the order, which is told."""
    best: list[Path | None] = [None] * len(depth)

    def take(found: list[Path | None]) -> None:
        nonlocal best
        if sum(f is not None for f in found) > sum(f is not None for f in best):
            best = found

    take(_equal(labels(depth), labels(others), others))
    ours, theirs = frame_numbers(depth), frame_numbers(others)
    if ours and theirs:
        take(_equal(ours, theirs, others))
    if 2 * sum(f is not None for f in best) < min(len(depth), len(others)):
        stamps, other_stamps = (times_of(files, str(files[0].parent)) for files in (depth, others))
        if stamps is None or other_stamps is None:  # numbers that differ may be times in any unit
            stamps, other_stamps = np.unique(ours or [0]), np.unique(theirs or [1])
        if len(stamps) == len(depth) and len(other_stamps) == len(others):
            nearest = nearest_in_time(stamps, other_stamps)
            take([others[j] if j >= 0 else None for j in nearest.tolist()])
    if len(depth) == len(others) and not any(best) and depth:
        warnings.warn(
            f"{others[0].parent}: {what} have neither names nor numbers of the depth images; paired in order",
            stacklevel=6,
        )
        return list(others)
    return best


def _equal(ours: Sequence[Hashable], theirs: Sequence[Hashable], files: Sequence[Path]) -> list[Path | None]:
    there = dict(zip(reversed(theirs), reversed(files), strict=True))  # of several the first
    return [there.get(key) for key in ours]


def tell_numbers(files: Sequence[Path]) -> None:
    numbers = frame_numbers(files)
    if numbers is None:
        return
    twice = sorted(n for n, count in Counter(numbers).items() if count > 1)
    if twice:
        warnings.warn(
            f"{files[0].parent}: several images have the number {_listed(twice, len(twice))}", stacklevel=6
        )
    present = np.unique(np.array(numbers, object))
    steps = np.diff(present)
    usual = Counter(steps.tolist()).most_common(1)[0][0] if len(steps) else 1
    gaps = [i for i, step in enumerate(steps.tolist()) if step > usual]
    missing = [range(present[i] + usual, present[i + 1], usual) for i in gaps]
    count = sum((r.stop - r.start + usual - 1) // usual for r in missing)
    if gaps and len(gaps) <= MOST_GAPS * len(steps) and count <= len(files):
        first = list(itertools.islice(itertools.chain(*missing), SHOWN))
        warnings.warn(f"{files[0].parent}: no image with the number {_listed(first, count)}", stacklevel=6)


def _listed(first: Sequence[int], count: int) -> str:
    shown = ", ".join(map(str, first[:SHOWN]))
    return shown if count <= SHOWN else f"{shown} and {count - SHOWN} more"


UNITS = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}  # per second
LONGEST_STEP_S = 1.0  # between frames, of a unit other than seconds
LONGEST_IN_S = 5.0  # seconds are what formats define: a slow recording stays one
# Times since 1970, in 2001 to 2096, tell their unit themselves.
EPOCH_S, LONGEST_EPOCH_STEP_S = (1e9, 4e9), 600.0


def in_seconds(times: Sequence[Any] | NDArray[Any], name: str) -> NDArray[np.float64]:
    """Times (N,) of successive frames in seconds, with a warning that names the file and the unit if it is another.
    Whole numbers are divided as such: nanoseconds since 1970 have more digits than a float64."""
    values = list(times)
    unit = _unit(np.array(values, np.float64))
    if unit == "s":
        return np.array(values, np.float64)
    warnings.warn(f"{name}: the times are read as {unit}, by the step between them", stacklevel=6)
    return np.array([value / UNITS[unit] for value in values], np.float64)


def _unit(times: NDArray[np.float64]) -> str:
    steps = np.abs(np.diff(times))
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    middle = abs(float(np.median(times))) if len(times) else 0.0
    for unit, per_s in UNITS.items():
        longest = LONGEST_EPOCH_STEP_S if unit == "s" else LONGEST_STEP_S
        if EPOCH_S[0] <= middle / per_s < EPOCH_S[1] and step <= longest * per_s:
            return unit
    if step <= LONGEST_IN_S:
        return "s"
    return next((unit for unit, n in UNITS.items() if n > 1 and step <= LONGEST_STEP_S * n), "ns")


@dataclass(frozen=True)
class Stream:
    """The images of one sensor: ascending timestamps, and `read(i)`: (H, W) uint16 depth units or (H, W, 3) uint8 RGB.
    `read` raises ValueError with the reason if an image cannot be read."""

    stamps_s: NDArray[np.float64]
    read: Callable[[int], NDArray[Any]]


class StreamFrames:
    """One frame per depth image; unreadable ones are returned as `Frame.unreadable` with the reason. Reading is locked:
    files and their decoders are not made for several threads."""

    def __init__(self, name: str, depth: Stream, color: Stream | None, depth_scale: float) -> None:
        if not len(depth.stamps_s):
            raise ValueError(f"{name}: the recording has no depth images, which the trackers require")
        self._name, self._depth, self._color, self._scale = name, depth, color, depth_scale
        stamps = color.stamps_s if color is not None else np.empty(0)
        self._nearest = nearest_in_time(depth.stamps_s, stamps)
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self._depth.stamps_s)

    def __getitem__(self, i: int) -> Frame:
        stamp = float(self._depth.stamps_s[i])
        try:
            with self._lock:
                units, color = self._depth.read(i), None
                if self._color is not None and self._nearest[i] >= 0:
                    color = self._color.read(int(self._nearest[i]))
            return Frame(units, color, stamp, depth_scale=self._scale, index=i, check_units=False)
        except (ValueError, TypeError, OSError) as error:
            return Frame.unreadable(f"{self._name}, frame {i}: {error}", stamp, i)


def nearest_in_time(stamps_s: NDArray[np.float64], others_s: NDArray[np.float64]) -> NDArray[np.intp]:
    """Index of the nearest of `others_s` for each of `stamps_s`, at most half a period of the slower stream away. Both
    ascending, in seconds; -1 where there is none."""
    if not len(others_s):
        return np.full(len(stamps_s), -1)
    after = np.searchsorted(others_s, stamps_s).clip(1, max(1, len(others_s) - 1))
    before = after - 1
    after = np.minimum(after, len(others_s) - 1)
    left, right = np.abs(others_s[before] - stamps_s), np.abs(others_s[after] - stamps_s)
    nearest = np.where(left <= right, before, after)
    periods = [float(np.median(np.diff(times))) for times in (stamps_s, others_s) if len(times) > 1]
    limit = 0.5 * max(periods, default=1 / 30)
    return np.where(np.minimum(left, right) <= limit * (1 + 1e-9), nearest, -1)
