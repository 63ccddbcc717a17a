# SPDX-License-Identifier: MIT
"""Which images of two folders belong together: by name, by number, by time or in order."""

from __future__ import annotations

import itertools
import re
import warnings
from collections import Counter
from collections.abc import Hashable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.time_units import in_seconds
from sdftrack.io.datasets.streams import nearest_in_time

MOST_GAPS = 0.34  # of the steps between numbers: with more, they are chosen images, and none is missing
SHOWN = 5  # numbers in a message
STAMP_DIGITS = 13  # of a whole number that is a time: milliseconds since 1970
_TIME = re.compile(r"\D*(\d+\.\d+)")
_REDWOOD = re.compile(r"\d+-(\d+)")  # number-microseconds


def labels(files: Sequence[Path]) -> list[str]:
    """The names of images without the suffix; with that of their folder, where each has a folder of its own."""
    stems = [file.stem for file in files]
    return (
        stems
        if len(set(stems)) > 1 or len(stems) < 2
        else [f"{file.parent.name}/{file.stem}" for file in files]
    )


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
    """Times of images in seconds, from their names: those of `times_in_names`, or Redwood's microseconds."""
    redwood = [_REDWOOD.fullmatch(file.stem) for file in files]
    if redwood and all(redwood):
        return np.array([1e-6 * int(m[1]) for m in redwood if m])
    times = times_in_names(files)
    return None if times is None else in_seconds(times, name)


def paired(depth: Sequence[Path], others: Sequence[Path], what: str = "colour images") -> list[Path | None]:
    """For each depth image the one of `others` that belongs to it, or None.

    By the way that pairs the most: equal names, equal numbers in the names, times in the names at most half a period
    apart, and last, if there are as many, the order, which is told.
    """
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
    """A warning for numbers of images that are there twice, or that are missing between others."""
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
