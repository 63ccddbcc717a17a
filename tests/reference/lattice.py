# SPDX-License-Identifier: MIT
"""The numpy twin of cpp/frame/depth_metres.cpp: the holes of depth that was warped into a larger image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LEAST_HOLES = 0.05  # of the measurements
STEP_PX = 11  # between rows that are looked at; a prime, so that they are not those of the lattice
WIDEST_PX = 2
SAME_SURFACE = 0.02  # of the distance, across a hole

Depth = NDArray[np.float32]


def without_lattice(depth: Depth) -> Depth:
    """The depth (H, W), m, 0 = no measurement, with the holes of a lattice filled; the same array without one.

    A hole of one or two pixels in a row, then in a column, is filled linearly between its ends if these are of one
    surface. The filled pixels are no measurements of their own: they follow their neighbours.
    """
    if min(depth.shape) <= WIDEST_PX + 1 or not _has_lattice(depth):
        return depth
    filled = depth.copy()
    for _ in range(2):  # rows, then columns
        for width in range(1, WIDEST_PX + 1):
            _fill(filled, width)
        filled = np.ascontiguousarray(filled.T)
    return filled


def _has_lattice(depth: Depth) -> bool:
    first = STEP_PX // 2
    samples = [depth[first::STEP_PX], np.ascontiguousarray(depth[:, first::STEP_PX].T)]
    holes = sum(width * len(_holes(s, width)[0]) for s in samples for width in range(1, WIDEST_PX + 1))
    return bool(holes > LEAST_HOLES * sum(np.count_nonzero(s) for s in samples))


def _holes(lines: Depth, width: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Row and column of the pixels that are the last before a hole of `width` pixels whose ends are of one surface."""
    measured = lines > 0
    hole = measured[:, : -width - 1] & measured[:, width + 1 :]
    for k in range(1, width + 1):
        hole &= ~measured[:, k : lines.shape[1] - width - 1 + k]
    row, at = np.nonzero(hole)
    left, right = lines[row, at], lines[row, at + width + 1]
    near = np.abs(left - right) <= SAME_SURFACE * np.minimum(left, right)
    return row[near], at[near]


def _fill(lines: Depth, width: int) -> None:
    row, at = _holes(lines, width)
    left, right = lines[row, at], lines[row, at + width + 1]
    for k in range(1, width + 1):
        lines[row, at + k] = left + np.float32(k / (width + 1)) * (right - left)
