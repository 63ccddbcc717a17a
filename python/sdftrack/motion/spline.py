# SPDX-License-Identifier: MIT
"""Uniform B-splines whose coefficients have a Gaussian posterior, by banded matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg.lapack import dpbtrf, dpbtrs, dtbtrs
from scipy.sparse import csr_array

__all__ = ["BandedPosterior", "UniformSpline"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class UniformSpline:
    """Splines on equidistant knots from `start_s` on.

    Parameters
    ----------
    start_s, step_s : float
        First knot and distance of knots, s.
    intervals : int
        Number of polynomial pieces.
    order : int
        m of the penalty: white noise in the m-th derivative, whose smoothing splines have degree 2 m - 1.
    """

    start_s: float
    step_s: float
    intervals: int
    order: int = 3

    @property
    def degree(self) -> int:
        return 2 * self.order - 1

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return self.intervals + self.degree

    @property
    def centers_s(self) -> Array:
        """(size,) middle of the spline that belongs to each coefficient, s, within the knots."""
        middle = self.start_s + self.step_s * (np.arange(self.size) - 0.5 * (self.degree - 1))
        return np.asarray(np.clip(middle, self.start_s, self.start_s + self.step_s * self.intervals))

    def basis(self, times_s: Array, derivative: int = 0) -> tuple[NDArray[np.int64], Array]:
        """First coefficient (n,) that a time depends on, and the weights (n, degree + 1) of it and those after it."""
        x = (np.asarray(times_s) - self.start_s) / self.step_s
        first = np.clip(np.floor(x).astype(np.int64), 0, self.intervals - 1)
        weights = _pieces(self.degree, derivative)
        powers = (x - first)[:, None] ** np.arange(self.degree + 1)
        return first, powers @ weights / self.step_s**derivative

    def evaluate(self, coefficients: Array, times_s: Array, derivative: int = 0) -> Array:
        """Values (n, ...) of splines with `coefficients` (size, ...) or a derivative of them."""
        first, weights = self.basis(times_s, derivative)
        if not len(first):
            return np.zeros((0, *coefficients.shape[1:]))
        low, width = int(first.min()), self.degree + 1
        used = coefficients[low : int(first.max()) + width]
        columns = (first[:, None] - low + np.arange(width)).ravel()
        basis = csr_array(
            (weights.ravel(), columns, width * np.arange(len(first) + 1)), (len(first), len(used))
        )
        return np.asarray(basis @ used.reshape(len(used), -1)).reshape(len(first), *coefficients.shape[1:])

    def differences(self, coefficients: Array) -> Array:
        """The m-th derivative as steps (size - m, ...): m-th differences of the coefficients over step^m."""
        return np.diff(coefficients, self.order, axis=0) / self.step_s**self.order

    def penalty_band(self, precision: Array) -> Array:
        """Lower band (order + 1, size) of the sum of `precision` (size - m,) times squared differences."""
        row = _binomial(self.order) / self.step_s**self.order
        band = np.zeros((self.order + 1, self.size))
        count = self.size - self.order
        for a in range(self.order + 1):
            for b in range(a + 1):
                band[a - b, b : b + count] += row[a] * row[b] * precision
        return band


def _binomial(m: int) -> Array:
    row = np.array([1.0])
    for _ in range(m):
        row = np.convolve(row, [-1.0, 1.0])
    return row


def _pieces(degree: int, derivative: int) -> Array:
    """(degree + 1, degree + 1): row p, column a is the coefficient of x^p of the a-th B-spline on one interval."""
    key = (degree, derivative)
    if key not in _CACHE:
        knots = np.arange(-degree, degree + 2, dtype=float)
        nodes = (np.arange(degree + 1) + 0.5) / (degree + 1)
        values = np.column_stack(
            [
                BSpline(knots, np.eye(degree + 1)[a], degree).derivative(derivative)(nodes)
                if derivative
                else BSpline(knots, np.eye(degree + 1)[a], degree)(nodes)
                for a in range(degree + 1)
            ]
        )
        _CACHE[key] = np.linalg.solve(nodes[:, None] ** np.arange(degree + 1), values)
    return _CACHE[key]


_CACHE: dict[tuple[int, int], Array] = {}


class BandedPosterior:
    """The Gaussian with precision A (a band) and mean A^-1 b.

    Parameters
    ----------
    band : (width, N) array
        Lower band of A: band[r, c] = A[c + r, c].
    right : (N,) or (N, k) array
        b; several columns are several means.

    Raises
    ------
    np.linalg.LinAlgError
        A is not positive definite: too few measurements.
    """

    def __init__(self, band: Array, right: Array) -> None:
        self._factor, info = dpbtrf(band, lower=1)
        if info:
            raise np.linalg.LinAlgError(f"row {info} of the precision is not positive")
        self.mean, _ = dpbtrs(self._factor, right, lower=1)

    def deviations(self, normal: Array) -> Array:
        """L^-T z (N, S) for standard normal z (N, S): samples less the mean."""
        out, _ = dtbtrs(self._factor, normal, uplo="L", trans="T")
        return np.asarray(out)
