# SPDX-License-Identifier: MIT
"""Combination of single-frame estimates: fusion, covariance, intervals, and outlier frames."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Array = NDArray[np.float64]
Estimates = dict[str, Any]  # what `_core.Calibration.examine` returns

LIKELY = 0.999  # a frame that fits is called an outlier once in a thousand
MAX_NOISE = 2.5  # of a frame, over the median of all
KNOWN = 1e-6  # of a direction's information, over that of one unknown alone
MIN_PART = 1e-3  # squared, of an unknown in an open direction
CLUSTERED_FROM = 30  # frames beyond the unknowns from which their own scatter is a steady measure


def fuse(values: Array, information: Array) -> tuple[Array, Array]:
    """Information-weighted mean (n,) of the frames' estimates (M, n) (thesis Eq. 3.23), and its covariance."""
    # `information` (M, n, n) is the inverse of each estimate's marginal covariance; the covariance of the mean is that
    # of the scatter of the estimates about it.
    total = np.linalg.inv(information.sum(axis=0))
    mean: Array = total @ np.einsum("mij,mj->i", information, values)
    pulls = np.einsum("mij,mj->mi", information, values - mean)
    frames, n = values.shape
    return mean, total @ (pulls.T @ pulls) @ total * frames / max(1, frames - n)


def covariance_of(estimates: Estimates) -> Array:
    """Covariance of the joint solution: sandwich estimator over frames, or over pixels if frames are few."""
    # Errors of pixels in one frame are correlated (voxel grid, correlated noise); those of different frames are not.
    # With enough frames their scatter measures this; docs/math/intrinsics.md, section 4.
    pulls = estimates["gradient"]
    frames, n = pulls.shape
    total, open_ = inverse_of(estimates["information"].sum(axis=0))
    if frames - n >= CLUSTERED_FROM:
        covariance = total @ (pulls.T @ pulls) @ total * frames / (frames - n)
    else:
        excess = max(1.0, float(np.mean(robust_chi2(estimates))) / n)
        covariance = total @ estimates["scatter"].sum(axis=0) @ total * excess
    covariance[open_] = covariance[:, open_] = 0.0  # an open unknown: nothing to be correlated with
    covariance[open_, open_] = np.inf
    return covariance


def inverse_of(information: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Pseudo-inverse (n, n) in the observable directions, and the parameters (n,) involved in unobservable ones."""
    # Each parameter is scaled by its own information, so that units do not matter. A direction without information
    # beyond rounding is unobservable, as are the parameters that it involves.
    own = np.diag(information)
    said: NDArray[np.bool_] = np.asarray(own > 0, dtype=np.bool_)
    unit = 1 / np.sqrt(np.where(said, own, 1.0))
    values, vectors = np.linalg.eigh(np.outer(unit, unit) * information)
    known = values > KNOWN
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T
    part = (vectors[:, ~known] ** 2).sum(axis=1)
    return np.outer(unit, unit) * inverse, np.asarray((part > MIN_PART) | ~said, dtype=np.bool_)


def robust_chi2(estimates: Estimates) -> Array:
    """(M,) squared length of each frame's gradient, whitened by its noise: chi-square with n degrees of freedom."""
    scatter = estimates["scatter"]
    size = np.trace(scatter, axis1=1, axis2=2)
    # A frame without measurements pulls nowhere: any scatter will do.
    least = np.where(size > 0, 1e-12 * size, 1.0)[:, None, None] * np.eye(scatter.shape[1])
    solved = np.linalg.solve(scatter + least, estimates["gradient"][:, :, None])[:, :, 0]
    return np.einsum("mi,mi->m", estimates["gradient"], solved)


def excess_scatter(values: Array, mean: Array, covariances: Array) -> float:
    """Scatter of the frames' estimates about their mean over what their own covariances state; 1: they agree."""
    # By the median over the frames, so that a few outliers have no say. Errors of depth that are the same over an
    # object, and others in the next frame, are in the scatter alone.
    if not len(values):
        return 0.0
    away = values - mean
    chi2 = np.einsum("mi,mi->m", away, np.linalg.solve(covariances, away[:, :, None])[:, :, 0])
    return math.sqrt(float(np.median(chi2)) / chi2_quantile(0.5, values.shape[1]))


def frame_test(estimates: Estimates, min_hits: int) -> dict[int, str]:
    """Frames to exclude, by index: too few pixels, a bad fit, or disagreement with the others."""
    # The last is a chi-square test at 99.9 % of the frame's gradient, with its scatter estimated from the median of all
    # frames; docs/math/intrinsics.md, section 5.
    n = estimates["gradient"].shape[1]
    out = {
        int(
            m
        ): f"only {estimates['hits'][m]} depth measurements within the outline (expected at least {min_hits})"
        for m in np.flatnonzero(estimates["hits"] < min_hits)
    }
    usual = float(np.median(estimates["noise_m"]))
    for m in np.flatnonzero(estimates["noise_m"] > MAX_NOISE * usual):
        noise_mm = 1e3 * estimates["noise_m"][m]
        out.setdefault(
            int(m), f"fits badly: residuals of {noise_mm:.1f} mm, {1e3 * usual:.1f} mm in the median frame"
        )
    chi2 = robust_chi2(estimates)
    limit = chi2_quantile(LIKELY, n) * max(1.0, float(np.median(chi2)) / chi2_quantile(0.5, n))
    for m in np.flatnonzero(chi2 > limit):
        out.setdefault(
            int(m), f"disagrees with the other frames: chi-square {chi2[m]:.0f}, expected below {limit:.0f}"
        )
    return out


def half_width95(sd: Array, frames: int) -> Array:
    """Half width of the 95 % interval for this sd, estimated from this many frames."""
    freedom = max(1, frames - len(sd))
    return sd * student_t975(freedom)


def student_t975(freedom: int) -> float:
    """97.5 % quantile of Student's t."""
    return float(stdtrit(freedom, 0.975))


def chi2_quantile(probability: float, freedom: int) -> float:
    """Quantile of chi-square by the Wilson-Hilferty approximation."""
    z = NormalDist().inv_cdf(probability)
    return freedom * (1 - 2 / (9 * freedom) + z * math.sqrt(2 / (9 * freedom))) ** 3
