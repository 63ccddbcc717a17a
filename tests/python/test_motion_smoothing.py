# SPDX-License-Identifier: MIT
"""The smoother of poses: against a Kalman smoother, against truth, and what it does with gaps."""

import numpy as np
import pytest
from motion_cases import SD_M, SD_RAD, measured_poses, noisy, reaches
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from reference.rts_smoother import smooth_coordinate
from sdftrack import motion
from sdftrack.motion.smoothing import _normal_equations
from sdftrack.motion.spline import BandedPosterior, UniformSpline


def turning(t):
    """A rotation that passes half a turn, and its angular velocity by differences."""

    def f(s):
        return Rotation.from_rotvec(
            np.column_stack([0.8 * np.sin(1.1 * s), 0.5 * np.sin(0.7 * s), 3.6 * np.sin(0.5 * s)])
        )

    e = 1e-4
    return f(t), (f(t + e) * f(t - e).inv()).as_rotvec() / (2 * e)


def wandering(t):
    x = np.column_stack([0.1 * np.sin(2 * t), 0.05 * np.cos(1.3 * t), 0.8 + 0.05 * np.sin(t)])
    v = np.column_stack([0.2 * np.cos(2 * t), -0.065 * np.sin(1.3 * t), 0.05 * np.cos(t)])
    return x, v


class TestSpline:
    @pytest.mark.parametrize("derivative", [0, 1, 2, 3])
    def test_values_are_those_of_scipy(self, derivative):
        spline = UniformSpline(2.0, 0.1, 12, 3)
        coefficients = np.random.default_rng(0).normal(size=spline.size)
        knots = 2.0 + 0.1 * np.arange(-5, 18)
        t = np.linspace(2.0, 3.2, 57)
        expected = (
            BSpline(knots, coefficients, 5).derivative(derivative)(t)
            if derivative
            else BSpline(knots, coefficients, 5)(t)
        )
        np.testing.assert_allclose(
            spline.evaluate(coefficients, t, derivative), expected, rtol=1e-9, atol=1e-7
        )

    def test_a_precision_that_is_not_positive_is_an_error(self):
        with pytest.raises(np.linalg.LinAlgError, match="row 2"):
            BandedPosterior(np.array([[1.0, -1.0, 1.0]]), np.ones(3))


def test_the_posterior_is_that_of_a_rauch_tung_striebel_smoother():
    """Splines with two knots per frame stand for the process of the Kalman smoother: means and deviations agree."""
    rng = np.random.default_rng(0)
    n, intensity = 150, 20.0
    t = np.arange(n) / 30
    variances = (1e-3 * rng.uniform(0.5, 2, n)) ** 2
    y = 0.1 * np.sin(3 * t) + np.sqrt(variances) * rng.standard_normal(n)
    means, covariances = smooth_coordinate(t, y, variances, intensity)

    spline = UniformSpline(0.0, 1 / 120, 4 * (n - 1), 3)
    band, right = _normal_equations(spline, *spline.basis(t), y[:, None], variances)
    band[:4] += spline.penalty_band(np.full(spline.size - 3, spline.step_s / intensity))
    posterior = BandedPosterior(band, right)
    normal = rng.standard_normal((spline.size, 4000))
    deviations = posterior.deviations(normal.copy())
    assert np.array_equal(deviations, posterior.deviations(normal, threads=2))
    # Position, velocity, acceleration; the last is rough, and a spline of finite knots is smoother than the process.
    for derivative, far, narrow in ((0, 0.02, 0.95), (1, 0.03, 0.95), (2, 0.06, 0.85)):
        sd = np.sqrt(covariances[:, derivative, derivative])
        mean = spline.evaluate(posterior.mean, t, derivative)[:, 0]
        assert np.abs((mean - means[:, derivative]) / sd).max() < far
        ratio = spline.evaluate(deviations, t, derivative).std(axis=1) / sd
        assert ratio.min() > narrow
        assert ratio.max() < 1.06


class TestAgainstTruth:
    def test_errors_are_as_large_as_stated(self):
        t = np.arange(900) / 30
        (x, v), (R, w) = wandering(t), turning(t)
        s = motion.smooth(noisy(t, x, R, seed=3), samples=300)
        mean, samples = s.mean(t), s.samples(t)
        inner = slice(10, -10)
        errors = {
            "position": (mean.positions_m[0] - x, samples.positions_m),
            "velocity": (mean.velocities_mps[0] - v, samples.velocities_mps),
            "turn": (mean.angular_velocities_radps[0] - w, samples.angular_velocities_radps),
        }
        for name, (error, drawn) in errors.items():
            ratio = np.sqrt((error[inner] ** 2).mean() / drawn.var(axis=0)[inner].mean())
            assert 0.7 < ratio < 1.15, name
        turned = (Rotation.from_matrix(mean.rotations[0]) * R.inv()).as_rotvec()
        assert np.sqrt((turned**2).mean()) < 0.45 * SD_RAD
        assert np.sqrt(((mean.positions_m[0] - x) ** 2).mean()) < 0.45 * SD_M

    @pytest.mark.parametrize("factor", [0.25, 1.0, 4.0])
    def test_noise_scales_find_the_factor_of_wrong_covariances(self, factor):
        t = np.arange(900) / 30
        right = noisy(t, wandering(t)[0], turning(t)[0], seed=5)
        wrong = motion.Trajectory(t, right.poses, right.covariances / factor**2)
        assert motion.smooth(wrong).noise_scales == pytest.approx((factor, factor), rel=0.06)

    def test_correlated_errors_are_used(self):
        """The coupled posterior is nearer to the truth than smoothing positions alone would be."""
        t = np.arange(600) / 30
        rng = np.random.default_rng(8)
        x = wandering(t)[0]
        C = np.diag([SD_M**2] * 3 + [SD_RAD**2] * 3)
        C[0, 4] = C[4, 0] = 0.995 * SD_M * SD_RAD
        errors = rng.multivariate_normal(np.zeros(6), C, len(t))
        poses = measured_poses(x, Rotation.from_rotvec(np.zeros((len(t), 3))), errors)
        error = {
            name: (
                motion.smooth(motion.Trajectory(t, poses, np.tile(c, (len(t), 1, 1)))).mean(t).positions_m[0]
                - x
            )[:, 0].std()
            for name, c in (("coupled", C), ("apart", np.diag(np.diag(C))))
        }
        assert error["coupled"] < 0.97 * error["apart"]

    def test_a_rotation_that_nobody_sees_does_not_move_the_position(self):
        """A ball: its rotation wanders, and a covariance that is almost singular links it to the position."""
        t, rng = np.arange(300) / 30, np.random.default_rng(4)
        x, sd = wandering(t)[0], np.repeat([1e-4, 3.0], 3)
        correlations = np.eye(6) + 0.9999 * (np.eye(6, k=3) + np.eye(6, k=-3))
        C = np.tile(correlations * np.outer(sd, sd), (len(t), 1, 1))
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, 3] = x + rng.normal(0, 7e-5, (len(t), 3))
        poses[:, :3, :3] = Rotation.from_rotvec(
            np.cumsum(rng.normal(0, 0.05, (len(t), 3)), axis=0)
        ).as_matrix()
        smoothed = motion.smooth(motion.Trajectory(t, poses, C)).mean(t).positions_m[0]
        assert np.linalg.norm(smoothed - x, axis=1).max() < 3e-4

    def test_rest_is_smoothed_more_than_motion(self):
        t = np.arange(300) / 30
        s = motion.smooth(noisy(t, reaches(t, [4.0]), seed=7))
        sd = s.samples(t).velocities_mps.std(axis=0).mean(axis=1)
        assert np.median(sd[10:90]) < 0.6 * np.median(sd[125:140])

    def test_tremor_above_the_noise_is_kept(self):
        """1.2 mm at 6 Hz for half of the time, not averaged away with the rest before it."""
        t, sd_m = np.arange(600) / 30, 2e-4
        x = np.tile([0.0, 0, 0.8], (600, 1))
        x[300:, 0] += 0.0012 * np.sin(2 * np.pi * 6 * t[300:])
        mean = motion.smooth(noisy(t, x, sd_m=sd_m)).mean(t).positions_m[0]
        assert mean[330:570, 0].std() > 0.95 * x[330:570, 0].std()
        assert mean[30:270, 0].std() < 0.5 * sd_m


class TestGaps:
    def trajectory(self, missing):
        t = np.arange(300) / 30
        status = ["lost" if missing(s) else "ok" for s in t]
        return t, noisy(t, wandering(t)[0], seed=1, status=status)

    def test_long_gaps_remain_gaps(self):
        t, trajectory = self.trajectory(lambda s: 4.0 <= s < 5.0)
        s = motion.smooth(trajectory)
        mean = s.mean(t)
        assert len(s.pieces) == 2
        inside = (t > 3.98) & (t < 4.99)
        assert not mean.observed[inside].any()
        assert np.isnan(mean.positions_m[0, inside]).all()
        assert mean.observed[~inside].all()

    def test_short_gaps_are_bridged_with_a_wider_interval(self):
        t, trajectory = self.trajectory(lambda s: 4.0 <= s < 4.2)
        s = motion.smooth(trajectory)
        samples = s.samples(t)
        assert len(s.pieces) == 1
        assert samples.observed.all()
        sd = samples.positions_m.std(axis=0).max(axis=1)
        assert sd[(t > 4.05) & (t < 4.15)].min() > 1.5 * np.median(sd)

    def test_weak_poses_count_less(self):
        t = np.arange(300) / 30
        x = wandering(t)[0]
        status = ["weak" if 3 <= s < 6 else "ok" for s in t]
        s = motion.smooth(noisy(t, x, seed=2, status=status))
        sd = s.samples(t).positions_m.std(axis=0).mean(axis=1)
        assert np.median(sd[100:170]) > 1.4 * np.median(sd[200:280])

    def test_too_few_poses(self):
        t = np.arange(5) / 30
        with pytest.raises(
            ValueError, match=r"expected at least 8 poses without a gap of more than 0.3 s, got 5"
        ):
            motion.smooth(noisy(t, wandering(t)[0]))
