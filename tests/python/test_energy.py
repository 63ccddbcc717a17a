# SPDX-License-Identifier: MIT
"""The energy of a frame: against its twin, against finite differences, and minimised where the answer is known."""

import dataclasses

import numpy as np
import pytest

import sdftrack as st
from reference import energies as twin
from reference import tracking
from sdftrack import geometry
from sdftrack.testing import assert_pose_close

RESIDUALS = ["point", "slope", "ray_hit"]
UNKNOWNS = [("pose",), ("pose", "scale"), ("pose", "intrinsics")]
SCALE_M, FLOOR = 0.004, 0.1
# The core samples in float32: phi is off by some 1e-8 m, at a voxel's border g is that of either side.
RESIDUAL_ATOL_M = 2e-6
SUM_RTOL = 2e-3
# Kinks of the interpolant at voxel borders and float32 costs; a wrong Jacobian is off by tens of percent.
SLOPE_RTOL = 1e-2
# Without noise the truth is the minimum up to float32 depth (3e-8 m) and kernels, measured 3e-8 m and 5e-7 rad; but
# some rays that graze the silhouette are classed at the start as hits and have none in the end: 1.3e-6 m, 8e-5 rad.
TRUTH_ATOL_M, TRUTH_ATOL_RAD = 5e-6, 2e-4
# A sub-pixel change of 120 px focal length moves points by less than the grain of the voxels (2 mm) lets through.
FOCAL_RTOL, CENTRE_ATOL_PX, SCALE_ATOL = 2e-3, 0.2, 1e-3

CAMERA = st.Camera(fx=120, fy=122, cx=39.5, cy=29.5, width=80, height=60)
START = geometry.pose([0.43, -0.88, 0.27], [0.006, -0.004, 0.353])


@pytest.fixture(scope="module")
def shape():
    return st.union(st.SDF.box([0.10, 0.06, 0.04], voxels=60), st.SDF.sphere(0.033, voxels=60))


@pytest.fixture(scope="module")
def frame(shape):
    depth = shape.render(CAMERA, geometry.pose([0.4, -0.9, 0.3], [0.004, -0.006, 0.35]))[0]
    noise = np.random.default_rng(3).normal(0, 0.001, depth.shape)
    return st.Frame(np.where(depth > 0, depth + noise, 0).astype(np.float32))


@pytest.fixture(params=RESIDUALS)
def energy(request, shape, frame):
    return make_energy(shape, frame, request.param)


SURE_GAIN = 1e9  # more than any step promises


def make_energy(shape, frame, residual, unknowns=("pose",), **options):
    options = {"outlier_floor": FLOOR, "scale_m": SCALE_M, **options}
    return st.Energy(shape, CAMERA, frame, START, residual=residual, unknowns=unknowns, **options)


class Twin:
    """The same frame seen by the twin: field, rays, depths and classes at the energy's start."""

    def __init__(self, energy):
        seen, camera = energy.residuals(energy.start), energy.camera
        self.depths = seen["depth_m"].astype(np.float64)
        self.rays = np.stack(
            [
                (seen["u_px"] - camera.cx) / camera.fx,
                (seen["v_px"] - camera.cy) / camera.fy,
                np.ones(len(self.depths)),
            ],
            axis=1,
        )
        objects = []
        for shape, T_cam_obj in zip(energy.shapes, energy.start.poses, strict=True):
            centre = tracking.make_shape(shape.values, shape.voxel_size, shape.origin).centre
            volume = shape.values, shape.voxel_size, shape.origin - centre
            T_obj_cam = tracking.centred(T_cam_obj, centre)
            objects.append(
                twin.ScaledObject(*volume, T_obj_cam, 0.0)
                if "scale" in energy.unknowns
                else twin.SingleObject(*volume, T_obj_cam)
            )
        self.field = objects[0]
        if len(objects) > 1:
            finest = min(shape.voxel_size for shape in energy.shapes)
            self.field = twin.SoftMin(tuple(objects), energy.options.union_sharpness / finest)
        if "intrinsics" in energy.unknowns:
            self.field = twin.WithIntrinsics(
                self.field, np.array([camera.fx, camera.fy, camera.cx, camera.cy])
            )
        # Which rays meet the model is decided by sharp thresholds: the core's own answer, which has its own test.
        self.gains = twin.classify(
            self.field, self.rays, self.depths, "point" if energy.options.residual == "point" else "slope"
        )
        if energy.options.residual == "ray_hit":
            self.gains = np.where(seen["hit"].astype(bool), 0.0, self.gains)
        self.penalty = twin.DepthLogistic(SCALE_M, energy.options.outlier_floor, energy.options.curvature)

    def linearize(self):
        return twin.linearize(self.field, self.rays, self.depths, self.gains, self.penalty)


def assert_same_model(core, reference):
    assert core.cost == pytest.approx(reference.cost, rel=SUM_RTOL)
    # Metres, radians, pixels: each unknown is compared in its own unit.
    unit = 1 / np.sqrt(np.diag(reference.hessian))
    slope = reference.gradient * unit
    np.testing.assert_allclose(core.gradient * unit, slope, atol=SUM_RTOL * np.abs(slope).max())
    np.testing.assert_allclose(
        core.hessian * np.outer(unit, unit), reference.hessian * np.outer(unit, unit), atol=SUM_RTOL
    )


# --- against the twin
def test_which_rays_meet_the_model_agrees_with_the_twin(shape, frame):
    energy = make_energy(shape, frame, "ray_hit")
    same = Twin(energy)
    expected = twin.classify(same.field, same.rays, same.depths, "ray_hit") == 0
    assert 0.5 < expected.mean() < 1  # both classes are there
    hits = energy.residuals(energy.start)["hit"].astype(bool)
    assert np.mean(hits == expected) > 0.99  # the two thresholds are sharp


def test_every_pixels_residual_and_weight_are_those_of_the_twin(energy):
    seen, same = energy.residuals(energy.start), Twin(energy)
    readings = [
        twin.read(same.field, r, z, gain)[0]
        for r, z, gain in zip(same.rays, same.depths, same.gains, strict=True)
    ]
    weights = [same.penalty(r).curvature for r in readings]
    assert len(readings) > 300
    np.testing.assert_allclose(seen["residual_m"], readings, atol=RESIDUAL_ATOL_M)
    np.testing.assert_allclose(seen["weight"], weights, rtol=SUM_RTOL, atol=1e-4 * max(weights))


MODELS = [(residual, {}) for residual in RESIDUALS]
MODELS += [(residual, {"unknowns": u}) for u in UNKNOWNS[1:] for residual in ("point", "ray_hit")]
MODELS += [("point", {"curvature": "printed", "outlier_floor": 0.0})]  # the square of the slope


@pytest.mark.parametrize(("residual", "options"), MODELS, ids=str)
def test_cost_gradient_and_hessian_are_those_of_the_twin(shape, frame, residual, options):
    energy = make_energy(shape, frame, residual, **options)
    core, same = energy.linearize(energy.start), Twin(energy)
    assert core.count == len(same.depths)
    assert_same_model(core, same.linearize())


BESIDE = [geometry.pose([0.1 * k, 0.2, 0], [0.02 * k, -0.015 * k, 0.01 * k]) for k in range(4)]


def union_energy(shape, count, residual, sharpness):
    """Copies of the shape that touch and stand in one another, all of them seen."""
    poses = np.stack([START @ T for T in BESIDE[:count]])
    depth = np.zeros((60, 80), np.float32)
    for T in poses:
        seen = shape.render(CAMERA, T)[0]
        depth = np.where((seen > 0) & ((depth == 0) | (seen < depth)), seen, depth)
    off = np.stack([T @ geometry.pose([0.02, 0, -0.03], [0.002, 0.001, -0.001]) for T in poses])
    return st.Energy(
        [shape] * count, CAMERA, st.Frame(depth), off, residual=residual, scale_m=SCALE_M, outlier_floor=FLOOR,
        union_sharpness=sharpness,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("residual", ["point", "ray_hit"])
@pytest.mark.parametrize(("count", "sharpness"), [(2, 2.0), (3, 40.0), (4, 2.0)])
def test_a_union_is_the_twins_soft_minimum(shape, count, sharpness, residual):
    energy = union_energy(shape, count, residual, sharpness)
    core = energy.linearize(energy.start)
    assert core.gradient.shape == (6 * count,)
    assert_same_model(core, Twin(energy).linearize())


def test_noise_that_grows_with_depth_scales_each_pixels_density(shape, frame):
    energy = make_energy(shape, frame, "point", noise_m=0.001, noise_per_m=0.01)
    same = Twin(energy)
    centre = tracking.centred(START, np.zeros(3))  # the box's centre is the object's origin here
    z_obj = np.linalg.inv(centre)[2, 3]
    noise = (0.001 + 0.01 * same.depths**2) / (0.001 + 0.01 * z_obj**2)
    assert np.ptp(noise) > 0.1
    assert_same_model(
        energy.linearize(energy.start),
        twin.linearize(same.field, same.rays, same.depths, same.gains, same.penalty, noise),
    )


# --- derivatives
@pytest.mark.parametrize("residual", RESIDUALS)
@pytest.mark.parametrize("unknowns", UNKNOWNS, ids=["pose", "scale", "intrinsics"])
def test_the_gradient_is_the_slope_of_the_cost_by_every_unknown(shape, frame, residual, unknowns):
    energy = make_energy(shape, frame, residual, unknowns)
    model = energy.linearize(energy.start)
    # One hundredth of a standard deviation: above the rounding of float32 poses, far below a voxel.
    h = np.maximum(2e-5, 0.01 / np.sqrt(np.diag(model.hessian)))
    h[-4:] = np.where("intrinsics" in unknowns, 0.02, h[-4:])  # px
    slopes = [
        (energy.cost(energy.moved(energy.start, d)) - energy.cost(energy.moved(energy.start, -d)))
        / (2 * d.max())
        for d in np.diag(h)
    ]
    unit = 1 / np.sqrt(np.diag(model.hessian))
    np.testing.assert_allclose(
        model.gradient * unit, slopes * unit, atol=SLOPE_RTOL * np.abs(slopes * unit).max()
    )


def test_linearize_and_cost_agree_on_the_cost(energy):
    x = energy.moved(energy.start, [0.001, 0, 0.001, 0.01, 0, -0.01])
    assert energy.linearize(x).cost == pytest.approx(energy.cost(x), rel=1e-6)


def test_the_cost_is_a_function_of_the_state_alone(energy):
    x = energy.moved(energy.start, [0.003, 0, 0.002, 0.02, 0, -0.01])
    before = energy.cost(x)
    energy.linearize(energy.start)
    st.minimize(energy)
    assert energy.cost(x) == before


# --- minimised, where the answer is known
def off_by(T, metres=0.005, degrees=3.0):
    axis = np.array([0.5, -0.7, 0.5])
    moved = geometry.pose(np.radians(degrees) * axis / np.linalg.norm(axis)) @ T
    moved[:3, 3] = T[:3, 3] + metres * np.array([0.6, -0.6, 0.53])
    return moved


@pytest.mark.parametrize("residual", RESIDUALS)
@pytest.mark.parametrize("body", ["box", "ellipsoid"])
def test_a_body_moved_off_comes_back_to_the_truth(body, residual):
    shape = (
        st.SDF.box([0.12, 0.09, 0.06], voxels=100)
        if body == "box"
        else st.SDF.ellipsoid([0.06, 0.045, 0.03], voxels=100)
    )
    truth = geometry.pose([0.5, -0.6, 0.2], [0.01, -0.005, 0.4])
    frame = st.Frame(shape.render(CAMERA.scaled(2), truth)[0])
    energy = st.Energy(shape, CAMERA.scaled(2), frame, off_by(truth), residual=residual, scale_m=0.004)
    result = st.minimize(energy, max_steps=60, cost_relative=0)
    assert_pose_close(result.x.poses[0], truth, TRUTH_ATOL_M, TRUTH_ATOL_RAD)
    assert result.stop not in ("damping_max", "not_finite", "no_data")


def test_a_step_that_promises_little_is_kept_without_a_look_and_is_the_last(shape, frame):
    energy = make_energy(shape, frame, "point")
    looked, sure = (st.minimize(energy, max_steps=2, sure_gain=gain) for gain in (0.0, SURE_GAIN))
    model = energy.linearize(energy.start)
    damped = model.hessian + looked.steps[0].damping * np.diag(np.diag(model.hessian))
    wanted = energy.moved(energy.start, np.linalg.solve(damped, -model.gradient))
    assert [step.damping for step in looked.steps] == pytest.approx([1e-3, 1e-4])
    assert [len(sure.steps), sure.steps[0].accepted, sure.stop] == [1, True, "small_gain"]
    np.testing.assert_allclose(sure.x.poses, wanted.poses, atol=1e-9)
    assert looked.steps[0].cost == pytest.approx(energy.cost(wanted), rel=1e-6)


def test_fixed_unknowns_stay(shape, frame):
    energy = make_energy(shape, frame, "ray_hit")
    fixed = [False, False, False, True, True, True]
    result = st.minimize(energy, fixed=fixed)
    np.testing.assert_allclose(result.x.poses[0][:3, :3], START[:3, :3], atol=1e-12)
    assert np.linalg.norm(result.x.poses[0][:3, 3] - START[:3, 3]) > 1e-4
    everything = st.minimize(energy, fixed=[True] * 6)
    assert everything.stop == "no_data"
    np.testing.assert_allclose(everything.x.poses[0], START, atol=1e-12)


def test_intrinsics_are_recovered_from_a_clean_frame_that_the_body_fills(shape):
    truth = geometry.pose([0.7, -0.6, 0.3], [0.0, 0.0, 0.16])  # near: perspective tells fx from Z
    camera = CAMERA.scaled(2)
    frame = st.Frame(shape.render(camera, truth)[0])
    wrong = dataclasses.replace(camera, fx=camera.fx * 1.01, fy=camera.fy * 0.99, cx=camera.cx + 1)
    energy = st.Energy(shape, wrong, frame, truth, unknowns=("pose", "intrinsics"), scale_m=0.002)
    found = st.minimize(energy, max_steps=100, cost_relative=0).x
    assert found.camera.fx == pytest.approx(camera.fx, rel=FOCAL_RTOL)
    assert found.camera.fy == pytest.approx(camera.fy, rel=FOCAL_RTOL)
    assert found.camera.cx == pytest.approx(camera.cx, abs=CENTRE_ATOL_PX)
    assert found.camera.cy == pytest.approx(camera.cy, abs=CENTRE_ATOL_PX)
    assert energy.camera == wrong  # the energy's own camera is not touched


def test_size_is_recovered(shape):
    truth = geometry.pose([0.7, -0.6, 0.3], [0.01, -0.005, 0.35])
    larger = st.SDF(1.05 * shape.values, 1.05 * shape.voxel_size, 1.05 * shape.origin)
    frame = st.Frame(larger.render(CAMERA.scaled(2), truth)[0])
    energy = st.Energy(shape, CAMERA.scaled(2), frame, truth, unknowns=("pose", "scale"))
    found = st.minimize(energy, max_steps=60, cost_relative=0).x
    assert found.scales[0] == pytest.approx(1.05, abs=SCALE_ATOL)
    # A second solve may start where the first one ended.
    assert st.minimize(energy, found, max_steps=5).cost <= energy.cost(found)


# --- back-projection
def test_back_project_is_depth_times_the_inverse_camera_matrix():
    depth = np.random.default_rng(2).uniform(0.3, 2, (60, 80)).astype(np.float32)
    depth[::3, ::2] = 0
    depth[1, 1] = np.nan
    points, pixels = st.back_project(depth, CAMERA)
    assert len(points) == len(pixels) == np.sum(depth > 0)
    x, y = pixels.T
    expected = depth[y, x][:, None] * (np.linalg.inv(CAMERA.K) @ np.stack([x, y, np.ones(len(x))])).T
    np.testing.assert_allclose(points, expected, atol=1e-6)  # the camera's rays are float32


# --- what an energy is of
def test_a_state_far_off_costs_more_but_is_no_error(shape, frame):
    energy = make_energy(shape, frame, "ray_hit", ("pose", "scale"))
    for scale in (1e-30, 1e30):
        assert np.isfinite(energy.cost(st.State(START[None], scales=np.array([scale]))))


def test_the_mask_of_a_frame_limits_the_pixels(shape, frame):
    mask = np.zeros((60, 80), bool)
    mask[:, 40:] = True
    half = make_energy(shape, frame.replace(mask=mask), "point")
    u = half.residuals(half.start)["u_px"]
    assert 0 < len(u) < make_energy(shape, frame, "point").linearize(half.start).count
    assert u.min() >= 40
