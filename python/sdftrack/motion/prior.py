# SPDX-License-Identifier: MIT
"""How much an object accelerates and how noisy its poses are: estimated from the trajectory itself.

The prior of each coordinate x(t) is white noise in x''' (minimum-jerk smoothing, the model of a Kalman smoother with
states position, velocity, acceleration). Its intensity changes over time, since an object that rests on the table and
one that is carried need different ones: it is the average over a short window of the jerk's second moment in the
posterior (expectation maximisation). So is the scale of the noise, over all times; docs/math/motion.md derives the
steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import gammaincinv

from sdftrack.motion.spline import BandedPosterior, UniformSpline

__all__ = ["NOISE_WINDOW_S", "MovementPrior", "estimate_prior", "quiet_level"]

Array = NDArray[np.float64]
WINDOW_S, NOISE_WINDOW_S = 0.15, 0.5  # standard deviations of the windows of jerk and noise
QUIET = 0.35  # part of the time without tremor that is enough to know the noise
ITERATIONS = 30
MEASURED_ITERATIONS = 10  # before the noise is estimated: the first ones follow it
PROBES = 30  # random vectors that estimate posterior variances
LEAST_JERK = 1e-6  # (m/s^3)^2 s per extent squared: a rest, and still well conditioned


@dataclass(frozen=True)
class MovementPrior:
    """Precisions of a coordinate's prior, and what it leaves of the measurements.

    Attributes
    ----------
    precision : (size - order,) float64
        Of the m-th differences of the coefficients over step^m.
    residuals : (n, C) float64
        Measured less smoothed values.
    absorbed : float
        Variance of the noise over that of the residuals, which the smoothed values follow a little.
    """

    precision: Array
    residuals: Array
    absorbed: float


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
    extent = max(float(np.ptp(values, axis=0).max()), 1e-3)
    # A start that hardly smooths, with the jerk of the noise itself: tremor must be there to be kept.
    jerk = np.full(size - m, max(1e4 * extent**2, 20 * float(variances.mean()) / h**5))
    scale2 = 1.0
    for step in range(ITERATIONS):
        band = data / scale2
        band[: m + 1] += spline.penalty_band(h / jerk)
        posterior = BandedPosterior(band, right / scale2)
        probes = posterior.deviations(rng.standard_normal((size, PROBES)))
        moment = h * _second_moment(spline.differences(posterior.mean), spline.differences(probes))
        jerk = np.maximum(gaussian_filter1d(moment, WINDOW_S / h, mode="nearest"), LEAST_JERK * extent**2)
        if step >= MEASURED_ITERATIONS:
            error = values - spline.evaluate(posterior.mean, times_s)
            ratio = _second_moment(error, spline.evaluate(probes, times_s)) / variances
            scale2 = max(quiet_level(ratio, NOISE_WINDOW_S / h, values.shape[1]), 1e-12)
    alone = quiet_level((error**2).mean(axis=1) / variances, NOISE_WINDOW_S / h, values.shape[1])
    return MovementPrior(h / jerk, error, scale2 / max(alone, 1e-12))


def quiet_level(ratio: Array, window: float, coordinates: int) -> float:
    """The level of a windowed average of squares where it is low, with the bias of that choice removed.

    The mean over all times would take tremor for noise, and then smooth it away.
    """
    smooth = gaussian_filter1d(ratio, window, mode="nearest")
    freedom = coordinates * min(len(ratio), 2 * np.sqrt(np.pi) * window)  # of a Gaussian window
    expected = 2 * gammaincinv(freedom / 2, QUIET) / freedom  # that quantile of chi squared over its freedom
    return float(np.percentile(smooth, 100 * QUIET) / expected)


def _second_moment(mean: Array, deviations: Array) -> Array:
    """Average over coordinates of mean^2 plus the posterior variance, which the coordinates share."""
    return np.asarray((mean**2).mean(axis=1) + (deviations**2).mean(axis=1))


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
