# SPDX-License-Identifier: MIT
"""The systematic part of a pose's covariance: the core against its twin, and coverage over random biases."""

import numpy as np
import pytest

import sdftrack as st
from experiments.trust.coverage import error_vector
from reference import energies as twin
from reference import systematic
from reference import tracking as twin_tracking
from sdftrack import geometry

CAMERA = st.Camera(285.0, 285.0, 159.5, 119.5, 320, 240)
POSE = geometry.pose([0.5, -0.4, 0.2], [0.01, -0.02, 0.6])
CHI2_95 = 12.592
NOISE_M = 0.001


@pytest.fixture(scope="module")
def box():
    return st.SDF.box([0.10, 0.07, 0.05], voxels=120)


def noisy(depth, rng, sigma=NOISE_M):
    return np.where(depth > 0, depth + rng.normal(0, sigma, depth.shape), 0).astype(np.float32)


def biased(depth, sd, rng):
    """Modes over the silhouette and 4 x 4 patches, as the model has them."""
    v, u = np.nonzero(depth > 0)
    error = systematic.modes(u, v) @ (sd * systematic.SHARES * rng.normal(size=6))
    patches = rng.normal(0, systematic.PATCH_SHARE * sd, (4, 4))
    row, column = ((p - p.min()) * 4 // (np.ptp(p) + 1) for p in (v, u))
    out = depth.astype(np.float64)
    out[v, u] += error + patches[row, column]
    return out


def test_the_core_adds_what_its_twin_does(box):
    small, sd = CAMERA.scaled(0.4), 0.003
    depth = noisy(box.render(small, POSE)[0], np.random.default_rng(0))
    told = {"threads": 1, "adapt_noise": False, "free_space": False, "motion_sigma_m": 0.0,
            "correlation_area_px": 1, "max_systematic_m": 0.0}  # fmt: skip
    start = st.Frame(depth)
    plain = st.Tracker(box, small, **told).start(start, poses=POSE)
    tracker = st.Tracker(box, small, **told, systematic_m=sd)
    result = tracker.start(start, poses=POSE)
    np.testing.assert_array_equal(plain.pose, result.pose)  # the fit itself does not ask for it
    shape = twin_tracking.make_shape(box.values, box.voxel_size, box.origin)
    K = [small.fx, small.fy, small.cx, small.cy]
    T_start, T_final = (twin_tracking.centred(T, shape.centre) for T in (POSE, result.pose))
    rays, depths = twin_tracking.select_pixels(depth, K, shape, T_start, tracker.options.padding_m)
    assert len(depths) < 1000  # so the core has looked at all of them
    field = twin.SingleObject(box.values, box.voxel_size, box.origin - shape.centre, T_final)
    gains = twin.classify(field, rays, depths, "ray_hit")
    penalty = twin.DepthLogistic(result.steps[0][-1].scale_m, tracker.options.outlier_floor)
    sums = twin_tracking.summarize(field, rays, depths, gains, penalty, box.voxel_size)
    uv = rays[:, :2] * K[:2] + K[2:]
    shifts, patches = systematic.bias_response(
        field, uv, rays, depths, gains, penalty, sums.A, shape.diameter
    )
    # The same error everywhere moves the object along the ray by as much.
    np.testing.assert_allclose(np.abs(shifts[:3, 0]), np.abs(T_final[:3, :3] @ [0, 0, 1]), atol=0.1)
    to_camera = np.stack(
        [
            twin_tracking.camera_covariance(np.outer(s, s), np.linalg.inv(T_final), -shape.centre)
            for s in shifts.T * systematic.SHARES[:, None] * sd
        ]
    ).sum(axis=0)
    to_camera += (systematic.PATCH_SHARE * sd) ** 2 * twin_tracking.camera_covariance(
        patches, np.linalg.inv(T_final), -shape.centre
    )
    to_camera[[0, 1], [0, 1]] += (systematic.LATERAL_SHARE * sd) ** 2
    added = result.covariance - plain.covariance
    unit = 1 / np.sqrt(np.diag(to_camera))
    np.testing.assert_allclose(added * np.outer(unit, unit), to_camera * np.outer(unit, unit), atol=0.05)


@pytest.mark.parametrize("sd", [0.001, 0.003])
def test_the_ellipsoid_holds_the_truth_under_random_biases_of_the_model(box, sd):
    rng = np.random.default_rng(round(1e4 * sd))
    tracker = st.Tracker(box, CAMERA, threads=1, systematic_m=sd, max_systematic_m=0.0)
    inside, draws = 0, 100
    for _ in range(draws):
        T = geometry.pose(rng.normal(0, 1, 3), [*rng.uniform(-0.05, 0.05, 2), 0.6])
        seen = T.copy()
        seen[:2, 3] += rng.normal(0, systematic.LATERAL_SHARE * sd, 2)
        depth = box.render(CAMERA, seen)[0]
        result = tracker.start(st.Frame(noisy(biased(depth, sd, rng), rng)), poses=T)
        e = error_vector(result.pose, T)
        inside += e @ np.linalg.solve(result.covariance, e) < CHI2_95
    assert 0.85 <= inside / draws <= 1.0


def test_a_sensor_of_which_nothing_is_stated_may_err_in_distance_and_be_late(box):
    """2 mm + 4 mm/m^2 Z^2 along the ray, bent by 0.4 of it over the object, half a frame late: reported only."""
    rng = np.random.default_rng(1)
    for _ in range(3):
        T = geometry.pose(rng.normal(0, 1, 3), [0.05, 0.02, 0.7])
        moved = T.copy()
        moved[:3, 3] += [0.003, -0.004, 0.006]
        frames = [st.Frame(noisy(box.render(CAMERA, pose)[0], rng, 0.001)) for pose in (T, moved)]

        def tracked(frames=frames, T=T, **options):
            tracker = st.Tracker(box, CAMERA, threads=1, **options)
            return [tracker.start(frames[0], poses=T), tracker.track(frames[1])]

        centre = T[:3, 3] + T[:3, :3] @ box_centre(box)
        error_m = 0.002 + 0.004 * centre[2] ** 2
        none = tracked(max_systematic_m=0.0)
        bent = tracked(max_systematic_m=0.0, systematic_m=0.4 * error_m)
        unstated = tracked()
        assert [r.systematic[0] for r in none] == [0, 0]
        assert unstated[0].systematic[0] == pytest.approx(error_m, rel=0.02)
        for a, b in zip(unstated, none, strict=True):
            np.testing.assert_array_equal(a.pose, b.pose)
        shift = np.zeros(6)
        shift[:3] = error_m * centre / np.linalg.norm(centre)
        expected = bent[0].covariance + np.outer(shift, shift)
        np.testing.assert_allclose(unstated[0].covariance, expected, rtol=0.05, atol=2e-8)
        late = np.zeros(6)
        late[:3] = unstated[1].pose[:3, 3] - unstated[0].pose[:3, 3]
        more = unstated[1].covariance - unstated[0].covariance
        np.testing.assert_allclose(more[:3, :3], 0.25 * np.outer(late, late)[:3, :3], atol=1.5e-6)


def box_centre(box):
    inside = np.argwhere(box.values < 0)[:, ::-1]
    return box.origin + box.voxel_size * (inside.min(0) + inside.max(0)) / 2


def test_what_residuals_share_beyond_the_noise_widens_the_covariance(box):
    rng = np.random.default_rng(2)
    depth = biased(box.render(CAMERA, POSE)[0], 0.008, rng)
    frame = st.Frame(noisy(depth, rng, 0.0005))
    seen = st.Tracker(box, CAMERA, threads=1).start(frame, poses=POSE)
    blind = st.Tracker(box, CAMERA, threads=1, max_systematic_m=0.0).start(frame, poses=POSE)
    np.testing.assert_array_equal(seen.pose, blind.pose)
    assert seen.systematic[0] > 0.001
    assert np.linalg.eigvalsh(seen.covariance - blind.covariance).min() > 0


def test_a_lateral_error_moves_the_pose_as_it_is(box):
    frame = st.Frame(noisy(box.render(CAMERA, POSE)[0], np.random.default_rng(0)))
    plain, shifted = (
        st.Tracker(box, CAMERA, threads=1, lateral_px=px).start(frame, poses=POSE).covariance
        for px in (0.0, 2.0)
    )
    expected = np.zeros((6, 6))
    expected[[0, 1], [0, 1]] = (2.0 * POSE[2, 3] / CAMERA.fx) ** 2
    np.testing.assert_allclose(shifted - plain, expected, rtol=0.02, atol=1e-12)
