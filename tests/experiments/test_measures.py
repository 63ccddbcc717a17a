# SPDX-License-Identifier: MIT
"""What the experiments count: each measure on a case whose answer is known."""

import numpy as np
import pytest

from experiments.calibration.ball import coverage_of_pairs
from experiments.calibration.convergence import within_from
from experiments.common.bound import pose_information
from experiments.common.pose_errors import Errors
from experiments.common.sweeps import TRUTH, values_of
from experiments.common.tracked_scene import Run
from experiments.common.truth import _exp
from experiments.tracking import recovery
from experiments.trust.coverage import coverage


def test_what_comes_late_into_the_band_or_leaves_it_again_is_not_called_within():
    truth = values_of(TRUTH)
    running = np.tile(truth, (10, 1))
    assert within_from(running, 10) == 1
    running[3, 2] += 2.1  # cx: 2 px are allowed
    assert within_from(running, 10) == 5
    assert within_from(running, 13) == 8  # three frames are not in the mean
    running[9, 0] += 5.8  # fx: 1 % is 5.75 px
    assert within_from(running, 10) is None


def test_coverage_is_95_percent_of_gaussian_errors():
    rng = np.random.default_rng(0)
    L = np.diag([1, 2, 3, 0.1, 0.2, 0.3]) @ (np.eye(6) + 0.3 * rng.normal(size=(6, 6)))
    errors = rng.normal(size=(4000, 6)) @ L.T
    c = coverage(errors, np.tile(L @ L.T, (4000, 1, 1)))
    held = np.array([*c.directions, c.position, c.rotation, c.joint])
    np.testing.assert_allclose(held, 0.95, atol=0.0104)  # 3 sd of a share of 4,000
    np.testing.assert_allclose(c.spread, 1, atol=0.034)
    over_sure = coverage(2 * errors, np.tile(L @ L.T, (4000, 1, 1)))
    assert over_sure.joint < 0.6


def _run(status, off_frames=()):
    n = len(status)
    metres = np.full(n, 0.001)
    metres[list(off_frames)] = 0.5
    errors = Errors(metres, np.zeros(n), np.zeros((n, 3)), np.zeros(n))
    return Run(errors, list(status), [0.001] * n)


def test_a_trial_is_judged_by_the_truth():
    good = _run(["ok"] * 5 + ["weak", "lost", "lost", "lost"] + ["lost", "ok", "ok"], [5, 6, 7, 8, 9])
    assert recovery.judge(good, 5, 4) == recovery.Trial(flagged=2, found=2, false_frames=0, lost_before=0)
    late = _run(["ok"] * 8 + ["lost"] + ["lost"] * 3, range(5, 12))
    assert recovery.judge(late, 5, 4) == recovery.Trial(flagged=4, found=None, false_frames=0, lost_before=0)
    # A wrong place after it was flagged, sure of it: in view again, and before.
    sure = _run(["ok"] * 5 + ["lost", "lost", "ok", "lost"] + ["ok", "ok", "weak"], [5, 6, 7, 8, 9, 10])
    assert recovery.judge(sure, 5, 4) == recovery.Trial(flagged=1, found=3, false_frames=3, lost_before=0)
    # Sure of a pose with nothing to see, however near the truth it is.
    unseen = _run(["ok"] * 5 + ["lost", "lost", "ok", "ok"] + ["ok"] * 3)
    assert recovery.judge(unseen, 5, 4).false_frames == 2
    assert recovery.judge(_run(["ok", "lost", "ok"] + ["lost"] * 3, [2]), 3, 1).lost_before == 2


COVERED = (0.90, 0.985)  # 50 runs of 12 and 20 correlated numbers: 95 % to within 3 sd of about 1.5 %


def test_intervals_hold_the_truth_as_often_as_they_say():
    parameters, points = coverage_of_pairs(50)
    assert COVERED[0] < parameters < COVERED[1]
    assert COVERED[0] < points < COVERED[1]


@pytest.mark.parametrize("pairs", [6, 8, 12])
def test_intervals_of_mapped_points_hold_with_few_pairs_too(pairs):
    _, points = coverage_of_pairs(40, pairs)
    assert COVERED[0] < points < 0.995  # cautious by the stated noise, which so few cannot measure


def test_information_is_the_slope_of_rendered_depth():
    """Central differences of a corner of three planes, moved by each unknown in turn."""
    rng = np.random.default_rng(1)
    origin, step = np.array([0.02, -0.01, 0.9]), 1e-6
    rays = rng.uniform(-0.1, 0.1, (30, 2))
    r = np.column_stack([rays, np.ones(30)])
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    which = np.arange(30) % 3
    n = q[which] * np.sign(r @ q.T)[np.arange(30), which][:, None]
    through = origin + 0.05 * rng.normal(size=(3, 3))

    def depth(p):
        R = _exp(np.array(p[3:]))
        moved_n = n @ R.T
        moved_x = (through[which] - origin) @ R.T + origin + np.array(p[:3])
        return np.einsum("ij,ij->i", moved_n, moved_x) / np.einsum("ij,ij->i", moved_n, r)

    eye = step * np.eye(6)
    J = np.column_stack([(depth(e) - depth(-e)) / (2 * step) for e in eye])
    keep = np.abs(np.einsum("ij,ij->i", n, r)) / np.linalg.norm(r, axis=1) >= np.cos(np.deg2rad(80.0))
    z = depth(np.zeros(6))
    usable = keep & (z > 0)
    information, _ = pose_information(z * usable, n, rays, origin)
    np.testing.assert_allclose(information, J[usable].T @ J[usable], rtol=1e-5, atol=1e-6)


def test_the_torques_of_the_long_arm_do_the_work_that_its_energy_gains():
    from experiments.lwpr.functions import JOINTS, long_arm_states, long_arm_torques

    q, speed, gain = np.split(long_arm_states(np.random.default_rng(0), 1)[0], 3)
    still = np.zeros(JOINTS)

    def torque(*state):
        return long_arm_torques(np.concatenate(state)[None])[0]

    def inertia(q):
        return np.array([torque(q, still, unit) - torque(q, still, still) for unit in np.eye(JOINTS)])

    h = 1e-6
    change = (inertia(q + h * speed) - inertia(q - h * speed)) / (2 * h)
    power = 0.5 * speed @ change @ speed + speed @ inertia(q) @ gain + torque(q, still, still) @ speed
    assert torque(q, speed, gain) @ speed == pytest.approx(power, rel=1e-6)
    np.testing.assert_allclose(inertia(q), inertia(q).T, atol=1e-12)
