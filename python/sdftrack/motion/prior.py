# SPDX-License-Identifier: MIT
"""How much an object accelerates, when it rests, and how noisy its poses are: estimated from the trajectory itself.

The prior of each coordinate x(t) is white noise in x''' (minimum-jerk smoothing, the model of a Kalman smoother with
states position, velocity, acceleration) and a velocity of variance V(t). Both intensities change over time, since an
object that rests on the table and one that is carried need different ones: they are the averages over a short window of
what the posterior says (expectation maximisation). In a rest V shrinks towards zero, so that noise is not measured as
path; docs/math/motion.md derives the steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from sdftrack.motion.spline import BandedPosterior, UniformSpline

__all__ = ["MovementPrior", "estimate_prior"]

Array = NDArray[np.float64]
WINDOW_S, VELOCITY_WINDOW_S = 0.15, 0.05  # standard deviations of the windows
VELOCITY_CORRELATION_S = 0.03
ITERATIONS, COMMON_ITERATIONS = 25, 3  # the first ones with one intensity for all times
PROBES = 30  # random vectors that estimate posterior variances


@dataclass(frozen=True)
class MovementPrior:
    """Precisions of a coordinate's prior, and the scale of its noise.

    Attributes
    ----------
    jerk_precision : (size - order,) float64
        Of the m-th differences.
    velocity_precision : (size - 1,) float64
        Of the first differences.
    noise_scale : float
        Factor of the standard deviations that were given.
    """

    jerk_precision: Array
    velocity_precision: Array
    noise_scale: float

    def band(self, spline: UniformSpline) -> Array:
        """Lower band (order + 1, size) of the prior's precision."""
        band = spline.penalty_band(self.jerk_precision)
        band[0, :-1] += self.velocity_precision
        band[0, 1:] += self.velocity_precision
        band[1, :-1] -= self.velocity_precision
        return band


def estimate_prior(spline: UniformSpline, times_s: Array, values: Array, variances: Array) -> MovementPrior:
    """The prior of C coordinates that share it.

    Parameters
    ----------
    spline : UniformSpline
    times_s : (n,) array
    values : (n, C) array
        Measured.
    variances : (n,) array
        Of the noise of each coordinate, up to a factor that is estimated.
    """
    rng = np.random.default_rng(0)
    h, size, m = spline.step_s, spline.size, spline.order
    data, right = _normal_equations(spline, times_s, values, variances)
    floor = 1e-12 * max(float(np.var(values, axis=0).sum()), 1e-12)
    # A start that hardly smooths: the first posterior follows the measurements.
    jerk = np.full(size - m, 1e4 * max(float(np.ptp(values, axis=0).max()) ** 2, 1e-6))
    velocity = np.full(size - 1, 1e2)
    scale2 = 1.0
    for step in range(ITERATIONS):
        prior = _prior(jerk, velocity, scale2, h)
        band = data / scale2
        band[: m + 1] += prior.band(spline)
        posterior = BandedPosterior(band, right / scale2)
        probes = posterior.deviations(rng.standard_normal((size, PROBES)))
        jerk_now = h * _second_moment(spline.differences(posterior.mean), spline.differences(probes))
        velocity_now = _second_moment(np.diff(posterior.mean, axis=0) / h, np.diff(probes, axis=0) / h)
        if step < COMMON_ITERATIONS:
            jerk = np.full_like(jerk, max(jerk_now.mean(), floor))
        else:
            jerk = np.maximum(_windowed(jerk_now, WINDOW_S / h), 1e-9 * jerk_now.mean() + floor)
            velocity = np.maximum(_windowed(velocity_now, VELOCITY_WINDOW_S / h), floor)
        error = values - spline.evaluate(posterior.mean, times_s)
        unsure = (spline.evaluate(probes, times_s) ** 2).mean(axis=1)
        scale2 = max(float((((error**2).mean(axis=1) + unsure) / variances).mean()), 1e-12)
    return _prior(jerk, velocity, scale2, h)


def _prior(jerk: Array, velocity: Array, scale2: float, h: float) -> MovementPrior:
    return MovementPrior(h / jerk, 1.0 / (h * VELOCITY_CORRELATION_S * velocity), float(np.sqrt(scale2)))


def _second_moment(mean: Array, deviations: Array) -> Array:
    """Average over coordinates of mean^2 plus the posterior variance, which the coordinates share."""
    return np.asarray((mean**2).mean(axis=1) + (deviations**2).mean(axis=1))


def _windowed(values: Array, width: float) -> Array:
    return np.asarray(gaussian_filter1d(values, width, mode="nearest"))


def _normal_equations(
    spline: UniformSpline, times_s: Array, values: Array, variances: Array
) -> tuple[Array, Array]:
    """Lower band (degree + 1, size) of B^T R^-1 B, and B^T R^-1 y (size, C)."""
    first, weights = spline.basis(times_s)
    data, right = np.zeros((spline.degree + 1, spline.size)), np.zeros((spline.size, values.shape[1]))
    scaled = weights / variances[:, None]
    for a in range(spline.degree + 1):
        for b in range(a + 1):
            np.add.at(data[a - b], first + b, scaled[:, a] * weights[:, b])
        np.add.at(right, first + a, scaled[:, a, None] * values)
    return data, right
