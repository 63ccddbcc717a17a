# SPDX-License-Identifier: MIT
"""The numpy twins against themselves: derivatives, known answers. What compares the core with them is elsewhere."""

import itertools

import numpy as np
import pytest

from experiments.trust.coverage import error_vector
from reference import optim, tracking
from sdftrack import geometry

STEP = 1e-6
# Central differences in double: rounding 1e-10, second order 1e-12.
DERIVATIVE_ATOL = 1e-7


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.3, 2.0, 3.1])
def test_an_mrp_is_the_tangent_of_a_quarter_of_the_angle(angle):
    axis = np.array([0.6, -0.64, 0.48])
    r = axis * np.tan(angle / 4)
    R = optim.rotation_from_mrp(r)
    np.testing.assert_allclose(R, geometry.pose(angle * axis)[:3, :3], atol=1e-14)
    np.testing.assert_allclose(optim.mrp_from_rotation(R), r, atol=1e-9)


def test_an_increment_moves_points_by_v_plus_w_cross_x():
    v, w, X = np.array([1, -2, 3]) * STEP, np.array([-3, 1, 2]) * STEP, np.array([0.4, -0.3, 0.2])
    moved = geometry.transform_points(optim.increment(v, w), X)
    np.testing.assert_allclose(moved - X, v + np.cross(w, X), atol=10 * STEP**2)


@pytest.mark.parametrize("turn", [0.01, 1.5])
def test_the_priors_gradient_is_the_slope_of_its_cost_near_and_far(turn):
    prior = optim.PosePrior(geometry.pose([0.2, 0.1, -0.3], [0.1, 0.2, 0.3]), 0.03, 0.3)
    x = optim.State(geometry.pose(turn * np.array([0.6, -0.64, 0.48]), [0.02, -0.01, 0.03]) @ prior.T_obj_cam)
    model = prior.linearize(x)
    assert model.cost == prior.cost(x) > 0
    slopes = [
        (prior.cost(optim.retract(x, STEP * e)) - prior.cost(optim.retract(x, -STEP * e))) / (2 * STEP)
        for e in np.eye(6)
    ]
    np.testing.assert_allclose(model.gradient, slopes, atol=DERIVATIVE_ATOL * np.abs(slopes).max())
    assert np.linalg.eigvalsh(model.hessian).min() > 0


def test_the_optimiser_finds_the_prior_alone():
    prior = optim.PosePrior(geometry.pose([0.2, 0.1, -0.3], [0.1, 0.2, 0.3]), 0.03, 0.3)
    start = optim.State(geometry.pose([-0.5, 0.3, 0.4], [0.0, 0.1, 0.2]))
    x, steps, stop = optim.minimize(prior.cost, prior.linearize, start, max_steps=50, cost_gain=1e-18)
    np.testing.assert_allclose(x.T_obj_cam, prior.T_obj_cam, atol=1e-8)
    assert stop == "small_gain"
    assert all(b.cost <= a.cost for a, b in itertools.pairwise(steps))


def test_size_and_intrinsics_move_by_addition():
    x = optim.State(np.eye(4), log_scale=0.1, K=np.array([500.0, 510, 320, 240]))
    moved = optim.retract(x, np.array([0, 0, 0, 0, 0, 0, 0.2, 1, 2, 3, 4]))
    assert moved.log_scale == pytest.approx(0.3)
    np.testing.assert_allclose(moved.K, [501, 512, 323, 244])
    np.testing.assert_array_equal(moved.T_obj_cam, np.eye(4))


def test_the_map_to_camera_axes_is_the_derivative_of_the_users_error():
    T_cam_centred = geometry.pose([0.5, -0.3, 0.8], [0.1, 0.2, 0.9])
    origin = np.array([0.05, -0.02, 0.11])  # the caller's origin in the centred frame
    shift = geometry.pose([0, 0, 0], origin)

    def users_error(delta):
        moved = T_cam_centred @ np.linalg.inv(optim.increment(delta[:3], delta[3:]))
        return error_vector(T_cam_centred @ shift, moved @ shift)

    J = np.array([(users_error(STEP * e) - users_error(-STEP * e)) / (2 * STEP) for e in np.eye(6)]).T
    C = np.diag([1.0, 2, 3, 4, 5, 6]) + 0.1
    np.testing.assert_allclose(
        tracking.camera_covariance(C, T_cam_centred, origin), J @ C @ J.T, atol=DERIVATIVE_ATOL
    )


def test_without_any_data_the_covariance_is_diameter_and_pi_squared():
    zero, none = np.zeros((6, 6)), np.zeros(6)
    C = tracking.increment_covariance(tracking.Sums(zero, zero, zero, none, none), 0.2)
    np.testing.assert_allclose(C, np.diag([0.04] * 3 + [np.pi**2] * 3))


def test_a_sandwich_of_gaussian_sums_is_the_inverse_information():
    rng = np.random.default_rng(0)
    J = rng.normal(size=(500, 6)) * [1, 1, 1, 0.1, 0.1, 0.1]
    information = J.T @ J / 0.001**2  # a quadratic cost: A = B, the prior of (diameter, pi) does not count
    sums = tracking.Sums(information, information, J.T @ J / len(J), np.zeros(6), np.zeros(6))
    np.testing.assert_allclose(
        tracking.increment_covariance(sums, 0.2),
        np.linalg.inv(information),
        rtol=1e-3,
        atol=1e-15,
    )


def test_the_plane_fit_is_exact_on_a_plane_and_does_not_mind_outliers():
    rng = np.random.default_rng(0)
    n = np.array([0.1, -0.8, -0.6]) / np.linalg.norm([0.1, -0.8, -0.6])
    points = np.array([0.0, 0.0, 1.0]) + rng.uniform(-0.5, 0.5, (2000, 3))
    points -= np.outer(points @ n + 0.55, n)
    points[::4] += rng.uniform(0.02, 0.3, (500, 1)) * n  # a quarter stands on it
    start = n + np.array([0.005, 0.0, -0.005])
    normal, offset = tracking.fit_plane(points, start / np.linalg.norm(start), 0.552, reach=0.02, rounds=20)
    np.testing.assert_allclose(normal, n, atol=1e-9)
    assert offset == pytest.approx(0.55, abs=1e-9)
