# SPDX-License-Identifier: MIT
"""Movements on a regular grid, and the smoothed one with its uncertainty: mean, covariance and samples at any time."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import number
from sdftrack.motion.spline import (
    BandedPosterior,
    SlowErrors,
    UniformSpline,
    exponentials_first,
    product_first,
)
from sdftrack.motion.trajectory import Trajectory

Array = NDArray[np.float64]
Kept = TypeVar("Kept")


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """S possible movements of one object over the same n times: one true movement, or samples of a posterior.

    Attributes
    ----------
    times_s : (n,) float64
        Regular.
    positions_m, velocities_mps, accelerations_mps2, jerks_mps3 : (S, n, 3) float64
        Of one point of the object, in the reference frame.
    rotations : (S, n, 3, 3) float64
        R_ref_obj.
    angular_velocities_radps : (S, n, 3) float64
        In the axes of the reference frame.
    observed : (n,) bool
        False in gaps: no pose was measured for longer than the smoother bridges.
    """

    times_s: Array
    positions_m: Array
    velocities_mps: Array
    accelerations_mps2: Array
    jerks_mps3: Array
    rotations: Array
    angular_velocities_radps: Array
    observed: NDArray[np.bool_]
    # What several measures ask for.
    _kept: dict[Any, Any] = field(default_factory=dict, repr=False, init=False)

    @property
    def rate_hz(self) -> float:
        """Samples per second."""
        return 1.0 / float(self.times_s[1] - self.times_s[0]) if len(self.times_s) > 1 else float("nan")

    @property
    def speeds_mps(self) -> Array:
        """(S, n) norms of the velocities."""
        return self.kept(
            "speeds", lambda: np.sqrt(np.einsum("snd,snd->sn", self.velocities_mps, self.velocities_mps))
        )

    def kept(self, key: Any, compute: Callable[[], Kept]) -> Kept:
        """The result of `compute`, which is called once for each `key`."""
        if key not in self._kept:
            self._kept[key] = compute()
        return cast(Kept, self._kept[key])

    def between(self, start_s: float, end_s: float) -> MotionSamples:
        """The part from `start_s` to `end_s`, both included."""
        a, b = np.searchsorted(self.times_s, [start_s - 1e-9, end_s + 1e-9])
        return self.kept(("between", a, b), lambda: self.part(slice(None), slice(a, b)))

    def part(self, samples: slice, times: slice) -> MotionSamples:
        """Some of the samples and of the times."""
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.init}
        of_times = ("times_s", "observed")
        return MotionSamples(
            **{k: v[times] if k in of_times else v[samples, times] for k, v in values.items()}
        )


MARGIN_S = 0.25


def with_rests(movements: Sequence[tuple[float, float]], k: int) -> tuple[float, float]:
    """(start, end) of movement `k` and up to 0.25 s of the rests beside it, at most half of a hold."""
    start, end = movements[k]
    before = 0.5 * (start - movements[k - 1][1]) if k > 0 else MARGIN_S
    after = 0.5 * (movements[k + 1][0] - end) if k + 1 < len(movements) else MARGIN_S
    return start - min(before, MARGIN_S), end + min(after, MARGIN_S)


TOGETHER = 64  # coefficients whose errors stay in the processor's cache
COORDINATES = 7  # x, y, z in metres and the quaternion x, y, z, w


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch without a long gap, from the first to the last measured pose: splines of the seven coordinates."""

    # `posterior` is that of the coefficients, coordinate by coordinate within a knot; `noise_scales` the noise of
    # positions and of rotations over what the covariances say; `position_noise_m` the standard deviation from frame to
    # frame, all axes together; `slow` what the covariances say beyond that noise.

    spline: UniformSpline
    posterior: BandedPosterior
    start_s: float
    end_s: float
    noise_scales: tuple[float, float]
    position_noise_m: float
    slow: SlowErrors | None = None

    @property
    def mean(self) -> Array:
        """(size, 7) coefficients."""
        return np.asarray(self.posterior.mean).reshape(self.spline.size, COORDINATES)

    def drawn(self, rng: np.random.Generator, count: int, threads: int = 1) -> Array:
        """(size, 7, count) coefficients of samples, with the slow errors."""
        # These change little from knot to knot, so a coefficient takes the error at the middle of its spline.
        normal = rng.standard_normal((self.mean.size, count))
        slow = None if self.slow is None else self.slow.drawn(rng, count)
        out = self.posterior.deviations(normal, threads).reshape(self.spline.size, COORDINATES, count)
        out += self.mean[:, :, None]
        if self.slow is not None and slow is not None:
            for first in range(0, self.spline.size, TOGETHER):
                some = slice(first, first + TOGETHER)
                errors = self.slow.spline.evaluate(slow, self.spline.centers_s[some])
                out[some, :3] += errors[:, :3]
                turns = exponentials_first(np.moveaxis(errors[:, 3:], 1, 0))
                q = np.moveaxis(out[some, 3:], 1, 0)
                q[:] = product_first(turns, q)
        return out

    def evaluate(self, times_s: Array, coefficients: Array) -> list[Array]:
        """The fields of `MotionSamples` from positions to angular velocities, by (size, 7, S) coefficients."""
        # Samples are the fastest axis in memory, so that nothing is copied: what is returned are views.
        curves = [
            _core.spline_values(*self.spline.basis(times_s, m), coefficients, COORDINATES if m < 2 else 3)
            for m in range(4)
        ]
        rotations, turning = _core.rotations_of_curve(curves[0][3:], curves[1][3:])
        fields = [np.transpose(p, (2, 1, 0)) for p in (*(c[:3] for c in curves), turning)]
        return [*fields[:4], np.transpose(rotations, (3, 2, 0, 1)), fields[4]]


class SmoothedMotion:
    """The posterior of an object's movement, from :func:`smooth`.

    Attributes
    ----------
    trajectory : Trajectory
        What was smoothed.
    pieces : list of Piece
        Stretches between gaps; nothing is claimed between them.
    noise_scales : (float, float)
        Standard deviation of the noise from frame to frame over that of the covariances, for positions and rotations,
        averaged over the pieces. Without covariances: in units of 1 mm and 0.01 rad.
    """

    def __init__(self, trajectory: Trajectory, pieces: list[Piece], samples: int, seed: int) -> None:
        self.trajectory, self.pieces, self._seed = trajectory, pieces, seed
        self._count = samples
        self._drawn: dict[int, Array] = {}

    def _average(self, values: list[Any]) -> Any:
        """Of the pieces, weighted by their lengths."""
        return np.average(values, axis=0, weights=[p.end_s - p.start_s for p in self.pieces])

    @property
    def noise_scales(self) -> tuple[float, float]:
        position, rotation = self._average([p.noise_scales for p in self.pieces])
        return float(position), float(rotation)

    @property
    def position_noise_m(self) -> float:
        """Standard deviation of the noise of a measured position from frame to frame, all axes together, m."""
        return float(np.sqrt(self._average([p.position_noise_m**2 for p in self.pieces])))

    def times_s(self, rate_hz: float) -> Array:
        """Regular times over the whole trajectory."""
        t = self.trajectory.times_s
        return np.asarray(t[0] + np.arange(int(np.floor((t[-1] - t[0]) * rate_hz + 1e-6)) + 1) / rate_hz)

    def mean(self, times_s: ArrayLike) -> MotionSamples:
        """The most probable movement, S = 1, at regular times; NaN in gaps."""
        return self._evaluated(np.asarray(times_s, np.float64), sampled=False)

    def samples(self, times_s: ArrayLike) -> MotionSamples:
        """Movements that are as probable as the posterior says, at regular times; the same ones in every call."""
        return self._evaluated(np.asarray(times_s, np.float64), sampled=True)

    def draw(self, threads: int = 1) -> None:
        """Draw the samples now, on `threads` (0: all cores); otherwise the first call that needs them does."""
        for k in range(len(self.pieces)):
            self._coefficients(k, sampled=True, threads=threads)

    def _coefficients(self, k: int, sampled: bool, threads: int = 1) -> Array:
        piece = self.pieces[k]
        if not sampled:
            return piece.mean[:, :, None]
        if k not in self._drawn:
            self._drawn[k] = piece.drawn(np.random.default_rng([self._seed, k]), self._count, threads)
        return self._drawn[k]

    def _evaluated(self, times: Array, sampled: bool) -> MotionSamples:
        S, n = self._count if sampled else 1, len(times)
        observed = np.zeros(n, bool)
        fields: Any = None
        for k, piece in enumerate(self.pieces):
            inside = (times >= piece.start_s - 1e-9) & (times <= piece.end_s + 1e-9)
            if not inside.any():
                continue
            values: Any = piece.evaluate(times[inside], self._coefficients(k, sampled))
            if inside.all():
                return MotionSamples(*(times, *values, inside))
            if fields is None:
                fields = [np.full((S, n, *v.shape[2:]), np.nan) for v in values]
            for kept, value in zip(fields, values, strict=True):
                kept[:, inside] = value
            observed |= inside
        if fields is None:
            fields = [np.full((S, n, 3), np.nan) for _ in range(6)]
            fields[4] = np.full((S, n, 3, 3), np.nan)
        return MotionSamples(*(times, *fields, observed))


def checked_gap(max_gap_s: float) -> float:
    """The longest gap that is bridged, s."""
    gap = number(max_gap_s, "max_gap_s")
    if not 0 < gap <= 10:
        raise ValueError(f"max_gap_s: expected more than 0 and at most 10 s, got {max_gap_s!r}")
    return gap


def smoothed_trajectory(motion: SmoothedMotion, rate_hz: float | None = None) -> Trajectory:
    """Most probable poses at regular times; "lost" in gaps.

    Parameters
    ----------
    motion : SmoothedMotion
    rate_hz : float, optional
        None: the frame rate of what was smoothed.
    """
    times = motion.times_s(motion.trajectory.rate_hz if rate_hz is None else rate_hz)
    mean = motion.mean(times)
    poses = np.full((len(times), 4, 4), np.nan)
    poses[mean.observed] = np.eye(4)
    poses[:, :3, :3][mean.observed] = mean.rotations[0, mean.observed]
    poses[:, :3, 3][mean.observed] = mean.positions_m[0, mean.observed]
    status = np.where(mean.observed, "ok", "lost").tolist()
    return dataclasses.replace(motion.trajectory, times_s=times, poses=poses, covariances=None, status=status)
