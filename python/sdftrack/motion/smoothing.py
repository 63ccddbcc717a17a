# SPDX-License-Identifier: MIT
"""A smoother of poses that uses their covariances: the posterior of a Kalman (RTS) smoother, in one banded system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import gammaincinv

from sdftrack._internal.validation import of_kind, whole
from sdftrack.motion.posterior import COORDINATES, Piece, SmoothedMotion, checked_gap
from sdftrack.motion.spline import (
    BandedPosterior,
    UniformSpline,
    continuous_quaternions,
    left_jacobians,
    slow_errors,
    values_at,
)
from sdftrack.motion.trajectory import Trajectory

Array = NDArray[np.float64]


WINDOW_S, NOISE_WINDOW_S = 0.15, 0.5  # standard deviations of the windows of jerk and noise
QUIET = 0.35  # part of the time without tremor that is enough to know the noise
ITERATIONS = 30
MEASURED_ITERATIONS = 10  # before the noise is estimated: the first ones follow it
PROBES = 30  # random vectors that estimate posterior variances
LEAST_JERK = 1e-6  # (m/s^3)^2 s per extent squared: a rest, and still well conditioned


@dataclass(frozen=True)
class MovementPrior:
    """Precisions of a coordinate's prior, and what it leaves of the measurements."""

    # `precision` is that of the m-th differences of the coefficients over step^m, `residuals` (n, C) are measured less
    # smoothed values; `absorbed` is the variance of the noise over that of the residuals, which the smoothed values
    # follow a little.

    precision: Array
    residuals: Array
    absorbed: float


def estimate_prior(spline: UniformSpline, times_s: Array, values: Array, variances: Array) -> MovementPrior:
    """The prior of C coordinates that share it, from measured `values` (n, C)."""
    # `variances` (n,) are those of the noise of each coordinate, up to a factor that is estimated.
    rng = np.random.default_rng(0)
    h, size, m = spline.step_s, spline.size, spline.order
    basis = spline.basis(times_s)
    data, right = _normal_equations(spline, *basis, values, variances)
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
            error = values - values_at(*basis, posterior.mean)
            ratio = _second_moment(error, values_at(*basis, probes)) / variances
            scale2 = max(quiet_level(ratio, NOISE_WINDOW_S / h, values.shape[1]), 1e-12)
    alone = quiet_level((error**2).mean(axis=1) / variances, NOISE_WINDOW_S / h, values.shape[1])
    return MovementPrior(h / jerk, error, scale2 / max(alone, 1e-12))


def quiet_level(ratio: Array, window: float, coordinates: int) -> float:
    """The level of a windowed average of squares where it is low, with the bias of that choice removed."""
    # The mean over all times would take tremor for noise, and then smooth it away.
    smooth = gaussian_filter1d(ratio, window, mode="nearest")
    freedom = coordinates * min(len(ratio), 2 * np.sqrt(np.pi) * window)  # of a Gaussian window
    expected = 2 * gammaincinv(freedom / 2, QUIET) / freedom  # that quantile of chi squared over its freedom
    return float(np.percentile(smooth, 100 * QUIET) / expected)


def _second_moment(mean: Array, deviations: Array) -> Array:
    """Average over coordinates of mean^2 plus the posterior variance, which the coordinates share."""
    return np.asarray(sum(np.einsum("ns,ns->n", x, x) / x.shape[1] for x in (mean, deviations)))


def _add(to: Array, at: NDArray[np.int64], values: Array) -> None:
    """to[at] += values, where places in `at`, which ascend, may be equal."""
    runs = np.flatnonzero(np.diff(at, prepend=-1))
    to[at[runs]] += np.add.reduceat(values, runs, axis=0)


def _normal_equations(
    spline: UniformSpline, first: NDArray[np.int64], weights: Array, values: Array, variances: Array
) -> tuple[Array, Array]:
    """Lower band (degree + 1, size) of B^T R^-1 B, and B^T R^-1 y (size, C)."""
    data, right = np.zeros((spline.degree + 1, spline.size)), np.zeros((spline.size, values.shape[1]))
    scaled = weights / variances[:, None]
    for a in range(spline.degree + 1):
        for b in range(a + 1):
            _add(data[a - b], first + b, scaled[:, a] * weights[:, b])
        _add(right, first + a, scaled[:, a, None] * values)
    return data, right


FINEST_STEP_S = 1 / 60  # of knots: hands move below 15 Hz
WEAK = 4.0  # factor of the covariance of weak poses, see docs/trust.md
DEFAULT_SD = np.repeat([1e-3, 1e-2], 3)  # m, rad: only their ratio over time matters, the scale is estimated
LINEAR_RAD = 0.2  # standard deviation: the sine is off by 1 % at twice that
MIN_FRAMES = 8  # of a piece: fewer do not determine accelerations


def smooth(
    trajectory: Trajectory, *, max_gap_s: float = 0.3, samples: int = 200, seed: int = 0
) -> SmoothedMotion:
    """Smooth a trajectory by its covariances.

    Parameters
    ----------
    trajectory : Trajectory
    max_gap_s : float
        Longer times without a pose ("ok" or "weak") remain gaps, s.
    samples : int
        Number of samples of the posterior, from which intervals are computed.
    seed : int
        Of these samples.

    Returns
    -------
    SmoothedMotion
        Mean, covariance and samples at any time.

    Raises
    ------
    ValueError
        Fewer than 8 poses without a long gap.

    Notes
    -----
    The covariances of the tracker, scaled so that they agree with the noise from frame to frame (`noise_scales`), are
    the weights of the poses; "weak" ones count with four times theirs. What they say beyond that noise is an error
    that changes slowly: no smoother averages it, so it is added to the samples. The prior is white noise in the third
    derivative of position and quaternion, as in minimum-jerk theory. Splines with knots at every frame and a
    penalty on their jerk have the posterior of a Rauch-Tung-Striebel smoother with the same process noise.
    """
    of_kind(trajectory, Trajectory, "trajectory")
    gap = checked_gap(max_gap_s)
    count, seed = whole(samples, "samples", 2, 100_000), whole(seed, "seed", 0)
    used = np.flatnonzero(trajectory.usable)
    cuts = np.flatnonzero(np.diff(trajectory.times_s[used]) > gap) + 1
    stretches = [part for part in np.split(used, cuts) if len(part) >= MIN_FRAMES]
    if not stretches:
        raise ValueError(
            f"{trajectory.name}: expected at least {MIN_FRAMES} poses without a gap of more than {gap:g} s, got "
            f"{max(len(p) for p in np.split(used, cuts))}; record longer, or allow longer gaps (max_gap_s)"
        )
    covariances = _noise(trajectory)
    pieces = [_piece(trajectory, part, covariances[part]) for part in stretches]
    return SmoothedMotion(trajectory, pieces, count, seed)


def _noise(trajectory: Trajectory) -> Array:
    """(N, 6, 6) covariances; where unknown the median of those that are known."""
    covariances = np.tile(np.diag(DEFAULT_SD**2), (len(trajectory), 1, 1))
    if trajectory.covariances is not None:
        known = np.isfinite(trajectory.covariances).all(axis=(1, 2)) & trajectory.usable
        if known.any():
            covariances[:] = np.median(trajectory.covariances[known], axis=0)
            covariances[known] = trajectory.covariances[known]
    weak = np.array([s == "weak" for s in trajectory.status or ()])
    covariances[weak] *= WEAK
    return _decoupled(covariances)


def _decoupled(covariances: Array) -> Array:
    """Without what links positions to rotations about axes that are not known to `LINEAR_RAD`."""
    # Such a rotation is off by more than the linear relation between the two holds for: applied to it, it would move
    # the position of a ball by millimetres because its print is not seen.
    values, axes = np.linalg.eigh(covariances[:, 3:, 3:])
    links = covariances[:, :3, 3:] @ axes
    links *= (values < LINEAR_RAD**2)[:, None, :]
    out = covariances.copy()
    out[:, :3, 3:] = links @ np.swapaxes(axes, 1, 2)
    out[:, 3:, :3] = np.swapaxes(out[:, :3, 3:], 1, 2)
    return out


def _piece(trajectory: Trajectory, part: NDArray[np.int64], covariances: Array) -> Piece:
    times, poses = trajectory.times_s[part], trajectory.poses[part]
    step = max(float(np.median(np.diff(times))), FINEST_STEP_S)
    spline = UniformSpline(float(times[0]), step, max(1, int(np.ceil((times[-1] - times[0]) / step - 1e-6))))
    q = continuous_quaternions(poses[:, :3, :3])
    variances = np.einsum("nii->ni", covariances)
    moving = estimate_prior(spline, times, poses[:, :3, 3], variances[:, :3].mean(axis=1))
    # Four coordinates share the noise of three: a quaternion changes by half a small rotation, never along itself.
    turning = estimate_prior(spline, times, q, variances[:, 3:].mean(axis=1) * (3 / 16))
    turned = 4 * np.einsum("nij,ni->nj", left_jacobians(q), turning.residuals)
    noise = [
        _noise_levels(moving.residuals, covariances[:, :3, :3], moving.absorbed, step),
        _noise_levels(turned, covariances[:, 3:, 3:], turning.absorbed, step),
    ]
    scales = float(np.sqrt(noise[0].max())), float(np.sqrt(noise[1].max()))
    scale = np.repeat(scales, 3)
    information = np.asarray(np.linalg.inv(covariances * np.outer(scale, scale)), np.float64)
    posterior = _coupled(spline, times, poses[:, :3, 3], q, information, moving, turning)
    level = quiet_level((moving.residuals**2).mean(axis=1), NOISE_WINDOW_S / step, 3)
    position_noise = float(np.sqrt(3 * moving.absorbed * level))
    slow = slow_errors(times, covariances, noise) if trajectory.covariances is not None else None
    return Piece(spline, posterior, float(times[0]), float(times[-1]), scales, position_noise, slow)


def _noise_levels(residuals: Array, covariances: Array, absorbed: float, step: float) -> Array:
    """(3,) variances of the noise from frame to frame over those of covariances (n, 3, 3), along their principal axes.

    Each axis on its own, from the best known to the least: one that is not seen, as the rotation of a can, changes
    slowly and says nothing of the others.
    """
    values, vectors = np.linalg.eigh(covariances)
    along = np.einsum("nji,nj->ni", vectors, residuals) ** 2 / values
    levels = [quiet_level(a, NOISE_WINDOW_S / step, 1) for a in along.T]
    return np.maximum(absorbed * np.array(levels), 1e-12)


def _coupled(
    spline: UniformSpline,
    times: Array,
    positions: Array,
    q: Array,
    information: Array,
    moving: MovementPrior,
    turning: MovementPrior,
) -> BandedPosterior:
    """All seven coordinates together, since the errors of position and rotation belong together."""
    n, m, C = len(times), spline.degree, COORDINATES
    # From (position, quaternion) to (position, small rotation): the inverse of q's change by a small rotation.
    J = np.zeros((n, 6, C))
    J[:, :3, :3] = np.eye(3)
    J[:, 3:, 3:] = 4 * np.swapaxes(left_jacobians(q), 1, 2)
    W = np.swapaxes(J, 1, 2) @ information @ J
    # The length of a quaternion is 1, as exactly as its direction is known.
    along = np.einsum("nii->n", information[:, 3:, 3:]) * 4 / 3
    W[:, 3:, 3:] += along[:, None, None] * q[:, :, None] * q[:, None, :]
    y = np.concatenate([positions, q], axis=1)
    first, weights = spline.basis(times)
    right = np.zeros((spline.size, C))
    blocks = np.zeros((m + 1, spline.size, C, C))  # [a - b, b]
    Wy = np.einsum("nij,nj->ni", W, y)
    for a in range(m + 1):
        _add(right, first + a, weights[:, a, None] * Wy)
        for b in range(a + 1):
            _add(blocks[a - b], first + b, (weights[:, a] * weights[:, b])[:, None, None] * W)
    for prior, coordinates in ((moving, range(3)), (turning, range(3, C))):
        for offset, row in enumerate(spline.penalty_band(prior.precision)):
            for c in coordinates:
                blocks[offset, :, c, c] += row
    return BandedPosterior(_interleaved(blocks), right.ravel())


def _interleaved(blocks: Array) -> Array:
    """Lower band of a symmetric matrix of blocks (offset, column, C, C), row of the block first."""
    offsets, size, C, _ = blocks.shape
    band = np.zeros((offsets * C, size * C))
    for offset in range(offsets):
        for i in range(C):
            for j in range(C):
                if (below := offset * C + i - j) >= 0:
                    band[below, j::C] = blocks[offset, :, i, j]
    return band
