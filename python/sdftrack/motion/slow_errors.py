# SPDX-License-Identifier: MIT
"""Errors that change slowly: what a covariance says beyond the noise from frame to frame.

The pose of a tracker is off by noise that is new in every frame and by an amount that depends on the view: the sensor's
distortion, the model's, a rotation that hardly shows. A smoother averages the first, not the second. The variance of
the noise from frame to frame is measured along each axis; the rest of the covariance is taken for slow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.motion.spline import UniformSpline

__all__ = ["SlowErrors", "slow_errors"]

Array = NDArray[np.float64]
UNSURE = 0.1  # of a measured variance: less than this is none
STEP_S = 0.35  # of knots: errors are alike within about twice that, the time of half a movement
LARGEST_TURN_RAD = 1.0  # standard deviation: more than that is unknown, and would turn samples over


@dataclass(frozen=True, eq=False)
class SlowErrors:
    """A Gaussian process of errors (x, y, z, rx, ry, rz) in m and rad.

    Attributes
    ----------
    spline : UniformSpline
    factors : (size, 6, 6) float64
        Square roots F of the covariance F F^T at each knot.
    """

    spline: UniformSpline
    factors: Array

    def drawn(self, rng: np.random.Generator, count: int) -> Array:
        """(size, 6, count) coefficients of samples."""
        normal = rng.standard_normal((self.spline.size, 6, count))
        return np.asarray(_unit_scale(self.spline) * self.factors @ normal)


def slow_errors(times_s: Array, covariances: Array, noise: list[Array], order: int) -> SlowErrors | None:
    """The slow part of covariances (n, 6, 6) at times (n,); None if all of it is noise.

    `noise`: (3,) variances of the noise from frame to frame over those of the covariances, along the principal axes of
    the position's and of the rotation's, best known first.
    """
    rest = [np.where(level < 1 - UNSURE, 1 - level, 0.0) for level in noise]
    if not np.any(rest):
        return None
    spline = UniformSpline(
        float(times_s[0]), STEP_S, max(1, int(np.ceil((times_s[-1] - times_s[0]) / STEP_S))), order
    )
    factors = np.zeros((spline.size, 6, 6))
    for k, part in enumerate((slice(0, 3), slice(3, 6))):
        values, vectors = np.linalg.eigh(_at_knots(spline, times_s, covariances[:, part, part]))
        sd = np.sqrt(np.maximum(values, 0.0) * rest[k])
        factors[:, part, part] = vectors * (np.minimum(sd, LARGEST_TURN_RAD) if k else sd)[:, None, :]
    return SlowErrors(spline, factors)


def _at_knots(spline: UniformSpline, times_s: Array, covariances: Array) -> Array:
    """Averages of covariances (n, 3, 3) about the middle of each coefficient's spline."""
    edges = np.searchsorted(times_s, [spline.centers_s - STEP_S, spline.centers_s + STEP_S])
    first = np.minimum(edges[0], len(times_s) - 1)
    last = np.maximum(edges[1], first + 1)
    totals = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(covariances, axis=0)])
    return np.asarray((totals[last] - totals[first]) / (last - first)[:, None, None])


def _unit_scale(spline: UniformSpline) -> float:
    """What makes the variance of a spline with independent coefficients one, averaged over a knot."""
    weights = spline.basis(spline.start_s + spline.step_s * np.linspace(0, 1, 20))[1]
    return float(1 / np.sqrt((weights**2).sum(axis=1).mean()))
