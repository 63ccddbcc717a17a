# SPDX-License-Identifier: MIT
"""Positions of the ball in both cameras, and its path between the frames."""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.array_equality import Compared

Array = NDArray[np.float64]
JUMP, JUMP_M = 6.0, 0.03  # of a path's points, in usual deviations and in metres beyond
LONGEST_GAP = 2.5  # usual frame periods that the path is carried over


@dataclass(frozen=True, eq=False)
class BallPairs(Compared):
    """N frames in which the ball was found in both images.

    Attributes
    ----------
    index : (N,) int
        Index of the frame in the input.
    center_cam : (N, 3) float64
        Centre at the time of the depth image, depth camera, m.
    center_covariance : (N, 3, 3) float64, m^2
    color_px : (N, 2) float64
        Projection of the centre in the colour image (not the centroid of the outline).
    color_covariance : (N, 2, 2) float64, px^2
    radius_px : (N,) float64
        Radius of the outline in the colour image.
    time_s : (N,) float64
        Timestamps; NaN if missing.
    residual_px : (N, 2) float64
        Measured minus mapped; NaN before a mapping is fitted, and if the path is undefined at the time of the colour
        image.
    kept : (N,) bool
        False: rejected as an outlier (see :func:`sdftrack.calibrate_color_to_depth`).
    """

    index: NDArray[np.int64]
    center_cam: Array
    center_covariance: Array
    color_px: Array
    color_covariance: Array
    radius_px: Array
    time_s: Array
    residual_px: Array
    kept: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.index)

    def part(self, which: NDArray[np.bool_]) -> BallPairs:
        """A subset of the pairs."""
        return BallPairs(*(getattr(self, f.name)[which] for f in fields(self)))


class Path:
    """The ball's centre between frames: cubic Hermite interpolation, slopes from polynomials through up to five points.

    With slopes of fourth order the error of a segment of length h is h^4 / 384 times the fourth derivative (eq. 10 of
    docs/math/color_to_depth.md); with second-order slopes (Catmull-Rom) it would be h^3 / 60 times the third.

    Parameters
    ----------
    time_s : (N,) increasing, N >= 2
    center_cam : (N, 3) m
    """

    def __init__(self, time_s: Array, center_cam: Array) -> None:
        self.t, self.c = time_s, center_cam
        h = np.diff(time_s)
        self.period = float(np.median(h))
        # A slope across a gap says little of the motion on either side of it: runs are kept apart.
        self.wide = h > LONGEST_GAP * self.period
        ends = [0, *(1 + np.flatnonzero(self.wide)), len(time_s)]
        self.slope = np.zeros_like(center_cam)
        for first, last in pairwise(ends):
            for k in range(first, last):
                low = min(max(first, k - 2), max(first, last - 5))
                near = slice(low, min(last, low + 5))
                self.slope[k] = _slope(time_s[near] - time_s[k], center_cam[near])

    @classmethod
    def through(cls, time_s: Array, center_cam: Array) -> Path:
        """A path without outlier points, where something else was taken for the ball.

        An outlier is farther from the line between its neighbours than JUMP times the typical distance, and 3 cm; the
        farthest is removed first, because it also affects its neighbours.
        """
        kept = np.arange(len(time_s))
        while len(kept) > 5:
            t, c = time_s[kept], center_cam[kept]
            s = ((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))[:, None]
            off = np.linalg.norm(c[1:-1] - (1 - s) * c[:-2] - s * c[2:], axis=1)
            worst = int(np.argmax(off))
            if off[worst] < JUMP * float(np.median(off)) + JUMP_M:
                break
            kept = np.delete(kept, 1 + worst)
        return cls(time_s[kept], center_cam[kept])

    def at(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Centres (N, 3), velocities (N, 3) and weights (N, 2) of the segment's two ends; NaN outside the path."""
        k = np.clip(np.searchsorted(self.t, time_s, side="right") - 1, 0, len(self.t) - 2)
        h = self.t[k + 1] - self.t[k]
        s = (time_s - self.t[k]) / h
        a, b, m, n = self.c[k], self.c[k + 1], self.slope[k] * h[:, None], self.slope[k + 1] * h[:, None]
        u = s[:, None]
        p = (
            (1 + 2 * u) * (1 - u) ** 2 * a
            + u * (1 - u) ** 2 * m
            + u**2 * (3 - 2 * u) * b
            - u**2 * (1 - u) * n
        )
        v = 6 * u * (u - 1) * (a - b) + (1 - u) * (1 - 3 * u) * m + u * (3 * u - 2) * n
        # At a measured point itself no gap matters.
        bad = (s < -1e-9) | (s > 1 + 1e-9) | (self.wide[k] & (s > 1e-9) & (s < 1 - 1e-9))
        p[bad] = np.nan
        return p, v / h[:, None], np.stack([1 - s, s], axis=1)


def _slope(t: Array, c: Array) -> Array:
    """Derivative at t = 0 of the polynomial through all points."""
    if len(t) < 2:
        return np.zeros(3)
    scale = float(np.abs(t).max())
    powers = np.vander(t / scale, increasing=True)
    slope: Array = np.linalg.solve(powers, c)[1] / scale
    return slope
