# SPDX-License-Identifier: MIT
"""Uniform B-splines whose coefficients have a Gaussian posterior, by banded matrices; quaternion curves (x, y, z, w).

A smooth curve q(t) that is nearly of unit length stands for the rotations of q / |q|. Its angular velocity is exact for
any length: w = 2 vec(q' q*) / |q|^2.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from sdftrack import _core

Array = NDArray[np.float64]


UNSURE = 0.1  # of a measured variance: less than this is none
STEP_S = 0.35  # of knots: errors are alike within about twice that, the time of half a movement
LARGEST_TURN_RAD = 1.0  # standard deviation: more than that is unknown, and would turn samples over


@dataclass(frozen=True, eq=False)
class SlowErrors:
    """A Gaussian process of errors (x, y, z, rx, ry, rz) in m and rad, of covariance F F^T at each knot (`factors`)."""

    spline: UniformSpline
    factors: Array

    def drawn(self, rng: np.random.Generator, count: int) -> Array:
        """(size, 6, count) coefficients of samples."""
        normal = rng.standard_normal((self.spline.size, 6, count))
        # The variance of a spline with independent coefficients is made one, averaged over a knot.
        weights = self.spline.basis(self.spline.start_s + self.spline.step_s * np.linspace(0, 1, 20))[1]
        scale = float(1 / np.sqrt((weights**2).sum(axis=1).mean()))
        return np.asarray(scale * self.factors @ normal)


def slow_errors(times_s: Array, covariances: Array, noise: list[Array]) -> SlowErrors | None:
    """The slow part of covariances (n, 6, 6) at times (n,); None if all of it is noise."""
    # `noise`: (3,) variances of the noise from frame to frame over those of the covariances, along the principal axes
    # of the position's and of the rotation's, best known first.
    rest = [np.where(level < 1 - UNSURE, 1 - level, 0.0) for level in noise]
    if not np.any(rest):
        return None
    spline = UniformSpline(
        float(times_s[0]), STEP_S, max(1, int(np.ceil((times_s[-1] - times_s[0]) / STEP_S)))
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


@dataclass(frozen=True)
class UniformSpline:
    """Splines of `intervals` polynomial pieces on equidistant knots from `start_s` on."""

    # `order` is the m of the penalty: white noise in the m-th derivative, whose smoothing splines have degree 2 m - 1.

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
        powers = np.vander(x - first, self.degree + 1, increasing=True)
        return first, powers @ weights / self.step_s**derivative

    def evaluate(self, coefficients: Array, times_s: Array, derivative: int = 0) -> Array:
        """Values (n, ...) of splines with `coefficients` (size, ...) or a derivative of them."""
        return values_at(*self.basis(times_s, derivative), coefficients)

    def differences(self, coefficients: Array) -> Array:
        """The m-th derivative as steps (size - m, ...): m-th differences of the coefficients over step^m."""
        count = self.size - self.order
        return values_at(np.arange(count), np.tile(self._difference, (count, 1)), coefficients)

    @property
    def _difference(self) -> Array:  # (order + 1,) weights of coefficients in a step of the m-th derivative
        return np.asarray(np.diff(np.eye(self.order + 1), self.order, axis=0)[0] / self.step_s**self.order)

    def penalty_band(self, precision: Array) -> Array:
        """Lower band (order + 1, size) of the sum of `precision` (size - m,) times squared differences."""
        row = self._difference
        band = np.zeros((self.order + 1, self.size))
        count = self.size - self.order
        for a in range(self.order + 1):
            for b in range(a + 1):
                band[a - b, b : b + count] += row[a] * row[b] * precision
        return band


@functools.cache
def _pieces(degree: int, derivative: int) -> Array:
    """(degree + 1, degree + 1): row p, column a is the coefficient of x^p of the a-th B-spline on one interval."""
    knots = np.arange(-degree, degree + 2, dtype=float)
    nodes = (np.arange(degree + 1) + 0.5) / (degree + 1)
    values = [BSpline(knots, one, degree).derivative(derivative)(nodes) for one in np.eye(degree + 1)]
    return np.linalg.solve(nodes[:, None] ** np.arange(degree + 1), np.column_stack(values))


def values_at(first: NDArray[np.int64], weights: Array, coefficients: Array) -> Array:
    """Values (n, ...) of splines with `coefficients` (size, ...) by the basis at n times."""
    flat = np.ascontiguousarray(coefficients).reshape(len(coefficients), 1, -1)
    return _core.spline_values(first, weights, flat, 1).reshape(len(first), *coefficients.shape[1:])


class BandedPosterior:
    """The Gaussian with precision A and mean A^-1 b; several columns of b, (N, k), are several means."""

    # `band` (width, N) is the lower band of A, band[r, c] = A[c + r, c]. LinAlgError if A is not positive definite: too
    # few measurements.

    def __init__(self, band: Array, right: Array) -> None:
        self._factor, row = _core.band_factor(band)
        if row:
            raise np.linalg.LinAlgError(f"row {row} of the precision is not positive")
        self.mean = np.array(right, np.float64, order="C")
        _core.band_solve(self._factor, self.mean.reshape(len(right), -1))

    def deviations(self, normal: Array, threads: int = 1) -> Array:
        """Standard normal z (N, S) becomes L^-T z: samples less the mean, in place. 0 threads: all cores."""
        _core.band_deviations(self._factor, normal, threads)
        return normal


def continuous_quaternions(R: Array) -> Array:
    """(n, 4) unit quaternions of rotations (n, 3, 3), of the sign that is nearer to the one before."""
    from scipy.spatial.transform import Rotation

    q = np.asarray(Rotation.from_matrix(R).as_quat())
    flips = np.sign(np.einsum("ni,ni->n", q[1:], q[:-1]))
    q[1:] *= np.cumprod(np.where(flips < 0, -1.0, 1.0))[:, None]
    return q


def left_jacobians(q: Array) -> Array:
    """(n, 4, 3): change of q by a small rotation r on the left, R -> Exp(r) R."""
    x, y, z, w = q.T
    G = np.array([[w, z, -y], [-z, w, x], [y, -x, w], [-x, -y, -z]])
    return np.asarray(0.5 * np.moveaxis(G, 2, 0))


def matrices(q: Array) -> Array:
    """(..., 3, 3) rotations of quaternions (..., 4) of any length but 0."""
    x, y, z, w = np.moveaxis(q, -1, 0)
    s = 2.0 / (x * x + y * y + z * z + w * w)
    out = np.empty((3, 3, *x.shape))
    xs, ys, zs = s * x, s * y, s * z
    out[0, 0], out[0, 1], out[0, 2] = 1 - (ys * y + zs * z), xs * y - zs * w, xs * z + ys * w
    out[1, 0], out[1, 1], out[1, 2] = xs * y + zs * w, 1 - (xs * x + zs * z), ys * z - xs * w
    out[2, 0], out[2, 1], out[2, 2] = xs * z - ys * w, ys * z + xs * w, 1 - (xs * x + ys * y)
    return np.moveaxis(out, (0, 1), (-2, -1))


def product_first(p: Array, q: Array) -> Array:
    """(4, ...) product p q of quaternions (4, ...): the rotation of q, then that of p."""
    return np.concatenate(
        [
            p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3], axis=0),
            [p[3] * q[3] - (p[:3] * q[:3]).sum(axis=0)],
        ]
    )


def exponentials_first(w: Array) -> Array:
    """(4, ...) quaternions of rotation vectors (3, ...)."""
    half = 0.5 * np.sqrt((w**2).sum(axis=0))
    return np.concatenate([0.5 * w * np.sinc(half / np.pi), [np.cos(half)]])


def angles_between(R: Array, S: Array) -> Array:
    """(...) angles of the rotations R^T S of two (..., 3, 3), rad: arccos((trace - 1) / 2)."""
    trace = np.einsum("...ij,...ij->...", R, S)
    return np.asarray(np.arccos(np.clip(0.5 * (trace - 1), -1, 1)))
