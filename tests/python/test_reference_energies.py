# SPDX-License-Identifier: MIT
"""The core's energy against its numpy twin, and against finite differences of itself."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack import geometry
from sdftrack.reference import energies as twin

RESIDUALS = ["point", "slope", "ray_hit"]
SCALE_M, FLOOR = 0.004, 0.1
# The core samples in float32: phi is off by some 1e-8 m, at a voxel's border g is that of either side.
RESIDUAL_ATOL_M = 2e-6
SUM_RTOL = 2e-3
# Kinks of the interpolant at voxel borders and float32 costs; a wrong Jacobian is off by tens of percent.
SLOPE_RTOL = 1e-2


@pytest.fixture(scope="module")
def scene():
    shape = st.union(st.SDF.box([0.10, 0.06, 0.04], voxels=60), st.SDF.sphere(0.033, voxels=60))
    camera = st.Camera(fx=120, fy=122, cx=39.5, cy=29.5, width=80, height=60)
    truth = geometry.pose([0.4, -0.9, 0.3], [0.004, -0.006, 0.35])
    depth = shape.render(camera, truth)[0]
    noise = np.random.default_rng(3).normal(0, 0.001, depth.shape)
    frame = st.Frame(np.where(depth > 0, depth + noise, 0).astype(np.float32))
    start = geometry.pose([0.43, -0.88, 0.27], [0.006, -0.004, 0.353])
    return shape, camera, frame, start


@pytest.fixture(params=RESIDUALS)
def energy(request, scene):
    shape, camera, frame, start = scene
    return st.Energy(
        shape,
        camera,
        frame,
        start,
        residual=request.param,
        scale_m=SCALE_M,
        outlier_floor=FLOOR,
        noise_per_m=0,
    )


def pivot_of(shape):
    z, y, x = np.nonzero(shape.values <= 0)
    low_high = np.array([[a.min(), a.max()] for a in (x, y, z)])
    return shape.origin + shape.voxel_size * low_high.mean(axis=1)


def twin_pose(energy, T_cam_obj):
    shape = energy.shape
    return twin.Pose(shape.values, shape.voxel_size, shape.origin, np.linalg.inv(T_cam_obj), pivot_of(shape))


def pixels_of(energy):
    seen, camera = energy.residuals(energy.start), energy.camera
    rays = np.stack(
        [
            (seen["u_px"] - camera.cx) / camera.fx,
            (seen["v_px"] - camera.cy) / camera.fy,
            1 + 0 * seen["u_px"],
        ],
        axis=1,
    )
    return rays.astype(np.float64), seen["depth_m"].astype(np.float64), seen


def gains_of(energy, pose, rays, depths, hits):
    residual = energy.options.residual
    if residual == "point":
        return np.ones(len(rays))
    gains = np.array([twin.fallback_gain(pose, r, z) for r, z in zip(rays, depths, strict=True)])
    return gains if residual == "slope" else np.where(hits, 0.0, gains)


def test_which_rays_meet_the_model_agrees_with_the_twin(scene):
    shape, camera, frame, start = scene
    energy = st.Energy(shape, camera, frame, start, residual="ray_hit", noise_per_m=0)
    rays, depths, seen = pixels_of(energy)
    pose = twin_pose(energy, start)
    expected = np.array([twin.meets(pose, r, z) for r, z in zip(rays, depths, strict=True)])
    assert 0.5 < expected.mean() < 1  # both classes are there
    assert np.mean(seen["hit"].astype(bool) == expected) > 0.99  # the two thresholds are sharp


def test_every_pixels_residual_and_weight_are_those_of_the_twin(energy):
    rays, depths, seen = pixels_of(energy)
    pose = twin_pose(energy, energy.start.poses[0])
    gains = gains_of(energy, pose, rays, depths, seen["hit"].astype(bool))
    readings = [twin.read(pose, r, z, gain)[0] for r, z, gain in zip(rays, depths, gains, strict=True)]
    weights = [twin.logistic(r, SCALE_M, FLOOR)[2] for r in readings]
    assert len(readings) > 300
    np.testing.assert_allclose(seen["residual_m"], readings, atol=RESIDUAL_ATOL_M)
    np.testing.assert_allclose(seen["weight"], weights, rtol=SUM_RTOL, atol=1e-4 * max(weights))


def test_cost_gradient_and_hessian_are_those_of_the_twin(energy):
    rays, depths, seen = pixels_of(energy)
    pose = twin_pose(energy, energy.start.poses[0])
    gains = gains_of(energy, pose, rays, depths, seen["hit"].astype(bool))
    cost, gradient, hessian = twin.linearize(pose, rays, depths, gains, SCALE_M, FLOOR)
    core = energy.linearize(energy.start)
    assert core.count == len(depths)
    assert core.cost == pytest.approx(cost, rel=SUM_RTOL)
    np.testing.assert_allclose(core.gradient, gradient, atol=SUM_RTOL * np.abs(gradient).max())
    np.testing.assert_allclose(core.hessian, hessian, atol=SUM_RTOL * np.abs(hessian).max())


def test_the_printed_curvature_is_the_square_of_the_slope(scene):
    shape, camera, frame, start = scene
    energy = st.Energy(
        shape, camera, frame, start, residual="point", curvature="printed", scale_m=SCALE_M, outlier_floor=0.0
    )
    rays, depths, _ = pixels_of(energy)
    pose = twin_pose(energy, start)
    cost, gradient, hessian = twin.linearize(pose, rays, depths, np.ones(len(rays)), SCALE_M, 0.0, "printed")
    core = energy.linearize(energy.start)
    assert core.cost == pytest.approx(cost, rel=SUM_RTOL)
    np.testing.assert_allclose(core.gradient, gradient, atol=SUM_RTOL * np.abs(gradient).max())
    np.testing.assert_allclose(core.hessian, hessian, atol=SUM_RTOL * np.abs(hessian).max())


def test_the_gradient_is_the_slope_of_the_cost(energy):
    gradient = energy.linearize(energy.start).gradient
    h = 2e-5  # m and rad: above the rounding of float32 poses, far below a voxel
    slopes = [
        (energy.cost(energy.moved(energy.start, h * e)) - energy.cost(energy.moved(energy.start, -h * e)))
        / (2 * h)
        for e in np.eye(6)
    ]
    np.testing.assert_allclose(gradient, slopes, atol=SLOPE_RTOL * np.abs(gradient).max())


@pytest.mark.parametrize("outlier_floor", [0.0, 0.1])
def test_the_twins_penalty_is_consistent_with_itself(outlier_floor):
    h = 1e-8
    for r in (-0.02, -0.003, 0.0, 1e-5, 0.007):
        ahead, behind = (twin.logistic(r + d, SCALE_M, outlier_floor)[0] for d in (h, -h))
        _, slope, weight = twin.logistic(r, SCALE_M, outlier_floor)
        assert slope == pytest.approx((ahead - behind) / (2 * h), abs=1e-4 * 250)
        assert weight * r == pytest.approx(slope, abs=1e-6 * 250)
