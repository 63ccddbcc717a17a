# SPDX-License-Identifier: MIT
"""Intrinsics from a known object: the energy against its twin, truth recovered, honest intervals, clear errors."""

import dataclasses

import cv2
import numpy as np
import pytest
from scipy import stats

import sdftrack as st
from reference.calibration import marginal_information, numeric_rows, point_residual, residual
from sdftrack import _core
from sdftrack.calibration.intrinsics_result import refuse_unobservable
from sdftrack.calibration.lens import core_lens
from sdftrack.calibration.statistics import chi2_quantile, fuse, inverse_of

TRUTH = st.Camera(290.0, 286.0, 158.0, 121.5, 320, 240)
GUESS = st.Camera(319.0, 315.0, 168.0, 131.5, 320, 240)  # 10 % and 10 px (of 320) off
SIZE = (0.20, 0.16, 0.12)
FRAMES = 80
PATH = st.synth.sweep(near_m=0.45, far_m=0.8)  # steps of 2 cm at most
SIGMA_M = 0.001


@pytest.fixture(scope="module")
def box():
    return st.SDF.box(SIZE, voxels=100)


@pytest.fixture(scope="module")
def swept(box):
    return st.synth.sequence(box.to_mesh(), FRAMES, PATH, SIGMA_M, seed=3, camera=TRUTH, color=False)


@pytest.fixture(scope="module")
def frames(swept):
    return [swept[i] for i in range(FRAMES)]


@pytest.fixture(scope="module")
def found(frames, swept, box):
    return st.calibrate_intrinsics(frames, box, GUESS, swept.ground_truth[0][0])


def values_of(camera):
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy])


# --- the energy against its twin
def one_frame(box, frame, T, free=(0, 1, 2, 3), max_pixels=300, residual=_core.Residual.ray_hit):
    options = _core.IntrinsicsOptions()
    options.residual = residual
    options.max_pixels, options.threads = max_pixels, 1
    core = _core.Calibration(box._core_args, core_lens(TRUTH), list(free), options)
    core.add(frame.depth, None, T)
    truth = [core.lens.values[j] for j in free]
    core.solve(0.004, truth, [1e-6] * len(free))  # one frame says too little: the lens is held
    return core


@pytest.mark.parametrize(
    ("kind", "twin", "atol"),
    [
        (_core.Residual.ray_hit, residual, 2e-6),  # the core stops at 1e-5 m of phi, then steps
        (_core.Residual.point, point_residual, 2e-8),  # the core samples in float
    ],
)
def test_residuals_are_those_of_the_twin(box, frames, swept, kind, twin, atol):
    core = one_frame(box, frames[5], swept.ground_truth[5][0], residual=kind)
    seen = core.readings(0)
    volume = (box.values, box.voxel_size, np.array(box.origin))
    T_obj_cam = np.linalg.inv(core.poses[0])
    assert len(seen["u_px"]) > 150
    for i in range(0, len(seen["u_px"]), 10):
        u, v, d = (float(seen[k][i]) for k in ("u_px", "v_px", "reading_m"))
        expected = twin(volume, np.array(core.lens.values), T_obj_cam, u, v, d)
        assert expected == pytest.approx(seen["residual_m"][i], abs=atol)


def test_what_a_frame_says_of_the_lens_is_its_marginal_information():
    body = st.SDF.ellipsoid((0.12, 0.09, 0.07), voxels=100)
    seq = st.synth.sequence(body.to_mesh(), 1, "static", SIGMA_M, seed=3, camera=TRUTH, color=False)
    core = one_frame(body, seq[0], seq.ground_truth[0][0], max_pixels=80)
    seen, lens, T_obj_cam = core.readings(0), np.array(core.lens.values), np.linalg.inv(core.poses[0])
    volume = (body.values, body.voxel_size, np.array(body.origin))
    estimate = core.examine()
    s = float(estimate["noise_m"][0])
    hessian = np.zeros((10, 10))
    for i in range(len(seen["u_px"])):
        u, v, d = (float(seen[k][i]) for k in ("u_px", "v_px", "reading_m"))

        def moved(x, u=u, v=v, d=d):
            T = st.geometry.pose(x[3:6], x[:3]) @ T_obj_cam
            values = lens.copy()
            values[:4] += x[6:]
            return residual(volume, values, T, u, v, d)

        row = numeric_rows(moved, np.zeros(10), np.array([1e-5] * 6 + [1e-2] * 4))
        t2 = np.tanh(0.5 * seen["residual_m"][i] / s) ** 2  # -log((1 - e) sech^2(r / 2s) + e), e = 0.1
        likelihood = 0.9 * (1 - t2) + 0.1
        inlier = 0.9 * (1 - t2) / likelihood
        hessian += inlier * ((1 - t2) / 2 - 0.1 / likelihood * t2) / s**2 * np.outer(row, row)
    twin = marginal_information(hessian)
    assert estimate["information"][0] == pytest.approx(twin, rel=0.02, abs=0.02 * np.abs(twin).max())


# --- what is found
@pytest.mark.slow
def test_the_intrinsics_are_found_from_a_poor_guess(found):
    error = found.values - values_of(TRUTH)
    assert found.status == "ok", found.reason
    assert np.abs(error[:2] / 290).max() < 1e-3
    assert np.abs(error[2:]).max() < 0.3
    assert (np.abs(error) < 4 * found.sd).all()
    assert (found.interval95[:, 0] < found.values).all()
    assert (found.values < found.interval95[:, 1]).all()


def test_the_poses_come_with_them(found, swept):
    turns = [np.diag([1.0, *turn, 1.0]) for turn in ((1, 1), (-1, -1))]
    turns += [np.diag([-1.0, *turn, 1.0]) for turn in ((1, -1), (-1, 1))]  # a box looks the same from behind
    errors = []
    for i, T in zip(found.frames, found.poses, strict=True):
        each = [st.metrics.pose_error(T @ turn, swept.ground_truth[i][0]) for turn in turns]
        errors.append(min(each, key=lambda error: error[1]))
    metres, radians = np.array(errors).T
    assert np.median(metres) < 0.0005
    assert np.median(radians) < np.radians(0.05)
    # where the image cuts both ends off, the box may lie anywhere along itself
    assert np.mean(metres < 0.004) > 0.9


@pytest.mark.slow
def test_the_mean_of_the_frames_own_estimates_and_the_sources_residual_are_there_too(
    found, frames, swept, box
):
    assert found.joint
    assert np.abs(found.per_frame.fused - values_of(TRUTH)).max() < 1.5  # 0.5 %: each frame alone is noisy
    assert found.per_frame.running().shape == found.per_frame.values.shape
    assert set(found.per_frame.frames) <= set(found.frames)
    assert len(found.per_frame.frames) == len(found.per_frame.values)
    assert np.allclose(found.per_frame.running()[-1], found.per_frame.fused)
    # Alone, and with the source's residual.
    printed = st.calibrate_intrinsics(frames, box, GUESS, swept.ground_truth[0][0], False, residual="point")
    assert not printed.joint
    assert np.array_equal(values_of(printed.camera), printed.per_frame.fused)
    error = printed.values - values_of(TRUTH)
    assert not np.array_equal(printed.values, found.per_frame.fused)
    assert np.abs(error[:2] / 290).max() < 1e-2  # what the source prints at 1 mm: 1 %, 2 px
    assert np.abs(error[2:]).max() < 2.0


def test_the_result_has_the_same_bits_on_any_number_of_threads_and_in_the_order_asked_for(frames, swept, box):
    some, T, order = frames[:12], swept.ground_truth[0][0], [3, 0, 2, 1]
    one = st.calibrate_intrinsics(some, box, GUESS, T, threads=1)
    three = st.calibrate_intrinsics(some, box, GUESS, T, free=("cy", "fx", "cx", "fy"), threads=3)
    assert np.array_equal(one.values[order], three.values)
    assert np.array_equal(one.covariance[np.ix_(order, order)], three.covariance)


@pytest.mark.slow
def test_a_depth_that_reads_too_short_is_found():
    body = st.SDF.ellipsoid((0.12, 0.08, 0.06), voxels=100)
    seq = st.synth.sequence(body.to_mesh(), 60, PATH, SIGMA_M, seed=3, camera=TRUTH, color=False)
    short = [st.Frame(frame.depth / np.float32(1.02)) for frame in seq]
    free = ("fx", "fy", "cx", "cy", "depth_scale")
    found = st.calibrate_intrinsics(short, body, TRUTH, seq.ground_truth[0][0], free=free)
    assert found.extra["depth_scale"] == pytest.approx(1.02, abs=4 * found.sd[4])
    assert found.sd[4] < 0.004
    assert np.abs((found.values[:4] - values_of(TRUTH)) / found.sd[:4]).max() < 4


def test_a_depth_law_is_not_asked_of_flat_faces(frames, swept, box):
    with pytest.raises(
        ValueError, match=r"depth_scale cannot be estimated .* flat to \d+ %: use a curved shape"
    ):
        st.calibrate_intrinsics(frames, box, GUESS, swept.ground_truth[0][0], free=("fx", "depth_scale"))


@pytest.mark.slow
def test_distortion_is_found(box):
    camera = dataclasses.replace(TRUTH, distortion=(0.12, 0.0, 0.0, 0.0))
    seq = st.synth.sequence(box.to_mesh(), FRAMES, PATH, SIGMA_M, seed=5, camera=camera, color=False)
    free = ("fx", "fy", "cx", "cy", "k1")
    found = st.calibrate_intrinsics(seq, box, TRUTH, seq.ground_truth[0][0], free=free)
    assert found.camera.distortion[0] == pytest.approx(0.12, abs=4 * found.sd[4])
    assert found.sd[4] < 0.02


# --- frames that do not fit, motion that is missing
@pytest.mark.slow
def test_a_frame_of_another_camera_is_left_out_and_named(frames, swept, box):
    depths = [frame.depth for frame in frames]
    zoomed = cv2.warpAffine(
        depths[20], np.array([[1.15, 0, -24.0], [0, 1.0, 0]]), (320, 240), flags=cv2.INTER_NEAREST
    )
    depths[20] = zoomed
    found = st.calibrate_intrinsics([st.Frame(d) for d in depths], box, GUESS, swept.ground_truth[0][0])
    assert "chi-square" in found.left_out.get(20, "")
    assert np.abs(found.values - values_of(TRUTH)).max() < 0.4


def test_a_user_who_never_came_to_the_edges_is_told_so(box):
    path = st.synth.sweep(near_m=0.45, far_m=0.8, reach_x=0.1, reach_y=0.08)
    seq = st.synth.sequence(box.to_mesh(), 30, path, SIGMA_M, seed=1, camera=TRUTH, color=False)
    found = st.calibrate_intrinsics(seq, box, TRUTH, seq.ground_truth[0][0])
    assert found.status == "weak"
    assert "hardly reached its left" in found.reason
    assert (found.observability.coverage[0] == 0).any()


def test_an_object_that_never_moves_is_refused(frames, swept, box):
    with pytest.raises(ValueError, match="does not move"):
        st.calibrate_intrinsics([frames[0]] * 8, box, TRUTH, swept.ground_truth[0][0])


@pytest.mark.slow
def test_a_ball_shows_the_intrinsics_whatever_its_symmetry():
    ball = st.SDF.sphere(0.06, voxels=60)
    seq = st.synth.sequence(ball.to_mesh(), 50, PATH, SIGMA_M, seed=2, camera=TRUTH, color=False)
    found = st.calibrate_intrinsics(seq, ball, TRUTH, seq.ground_truth[0][0])
    assert np.abs((found.values - values_of(TRUTH)) / found.sd).max() < 4
    assert found.sd.max() < 1.0


def what_is_said(shape, places):
    """Information on fx, fy, cx and cy (4, 4) of noise-free views of a shape, and along how many ways it slides."""
    seq = st.synth.sequence(shape.to_mesh(), len(places), places, None, camera=TRUTH, color=False)
    options = _core.IntrinsicsOptions()
    options.max_pixels, options.threads = 1500, 1
    core = _core.Calibration(shape._core_args, core_lens(TRUTH), [0, 1, 2, 3], options)
    for i in range(len(places)):
        core.add(seq[i].depth, None, seq.ground_truth[i][0])
    core.solve(0.004, values_of(TRUTH).tolist(), [1e-6] * 4)  # the lens is held
    estimates = core.examine()
    return estimates["information"].sum(axis=0), estimates["open_shifts"]


LONG_M = 3.0  # the camera sees 0.7 m of it
NOTHING = 1e-3  # of what is said of the other unknowns: the grain of the voxels
POLE = st.SDF.cylinder(0.06, LONG_M, voxels=400)
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # the axis along the image's columns


def pole_at(x, z, lean=0.0):
    T = np.eye(4)
    c, s = np.cos(lean), np.sin(lean)
    T[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]) @ UPRIGHT
    T[:3, 3] = x, 0, z
    return T


def test_a_pole_that_stays_upright_says_nothing_of_heights_in_the_image():
    places = [pole_at(x, z) for x in (-0.12, 0.0, 0.15) for z in (0.6, 0.8)]
    information, open_shifts = what_is_said(POLE, places)
    assert (open_shifts == 1).all()
    own = np.diag(information)
    assert own[1] < NOTHING * own[0]
    assert own[3] < NOTHING * own[2]
    assert (np.linalg.eigvalsh(information[np.ix_([0, 2], [0, 2])]) > 0.01).all()  # fx and cx to some 10 px


def test_a_pole_that_leans_shows_heights_too():
    places = [pole_at(x, 0.7, lean) for x in (-0.1, 0.1) for lean in (-0.8, 0.0, 0.8)]
    information, _ = what_is_said(POLE, places)
    assert np.diag(information)[1] > NOTHING * np.diag(information)[0]
    assert np.diag(information)[3] > NOTHING * np.diag(information)[2]


def test_a_plate_whose_edges_are_out_of_view_says_nothing_at_all():
    plate = st.SDF.box((LONG_M, LONG_M, 0.1), voxels=200)
    T = np.array(
        [st.geometry.pose((turn, 0.7 * turn, 0.0), (0, 0, z)) for turn in (-0.4, 0.3) for z in (0.6, 0.9)]
    )
    information, open_shifts = what_is_said(plate, list(T))
    assert (open_shifts == 2).all()
    ball, _ = what_is_said(st.SDF.sphere(0.1, voxels=80), [st.geometry.pose((0, 0, 0), (0, 0, 0.6))])
    assert (np.diag(information) < NOTHING * np.diag(ball)).all()


def test_what_a_pole_cannot_show_is_refused_by_name_and_cause():
    places = [pole_at(0.1 * np.cos(a), 0.7 + 0.06 * np.sin(a)) for a in np.linspace(0, 6, 24)]
    seq = st.synth.sequence(POLE.to_mesh(), 24, places, SIGMA_M, camera=TRUTH, color=False)
    with pytest.raises(
        ValueError, match=r"does not show fy .*, cy .*: what is in view looks the same .* along a line"
    ) as e:
        st.calibrate_intrinsics(seq, POLE, TRUTH, places[0])
    assert "fx" not in str(e.value)


def test_only_the_unknowns_of_an_open_direction_are_not_known():
    said = np.diag([4.0, 1.0, 9.0, 1e-4])
    said[:2, :2] += np.array([[0, 2.0], [2.0, 0]])  # 2 x + y is known, x - 2 y is not
    inverse, open_ = inverse_of(said)
    assert open_.tolist() == [True, True, False, False]
    assert np.allclose(np.diag(inverse)[2:], [1 / 9, 1e4])
    assert inverse_of(np.diag([4.0, -1.0]))[1].tolist() == [False, True]


def test_a_start_of_a_sweep_is_not_refused_for_a_single_frame(frames, swept, box):
    found = st.calibrate_intrinsics(frames[:25], box, GUESS, swept.ground_truth[0][0])
    assert found.status == "weak"
    assert np.isfinite(found.sd).all()
    assert np.abs((found.values - values_of(TRUTH)) / found.sd).max() < 4


def test_too_few_frames_are_called_that():
    with pytest.raises(
        ValueError, match=r"does not show fx \(sd 200\), cy \(not at all\): 6 frames are too few"
    ):
        refuse_unobservable(("fx", "fy", "cy"), np.array([200.0, 3.0, np.inf]), TRUTH, 6, np.zeros(6))
    with pytest.raises(ValueError, match="nearer and farther"):
        refuse_unobservable(("fx",), np.array([200.0]), TRUTH, 60, np.zeros(60))


# --- bad input
def test_too_few_frames_say_why(frames, swept, box):
    with pytest.raises(ValueError, match="at least 5, found it in 3 of 3"):
        st.calibrate_intrinsics(frames[:3], box, TRUTH, swept.ground_truth[0][0])
    empty = [st.Frame(np.zeros((240, 320), np.float32))] * 6
    with pytest.raises(ValueError, match=r"found it in 0 of 6 \(frame 0: "):
        st.calibrate_intrinsics(empty, box, TRUTH, swept.ground_truth[0][0])


# --- statistics
def test_quantiles_are_those_of_the_tables():
    for n in (1, 4, 9):
        assert chi2_quantile(0.999, n) == pytest.approx(stats.chi2.ppf(0.999, n), rel=0.04)


def test_estimates_are_weighed_by_their_information_and_the_stated_covariance_is_their_scatter():
    rng = np.random.default_rng(0)
    off = []
    for _ in range(300):
        A = np.linalg.qr(rng.normal(size=(60, 3, 3)))[0] * rng.uniform(0.5, 2, size=(60, 1, 3))
        covariances = A @ np.swapaxes(A, 1, 2)
        values = np.einsum("mij,mj->mi", A, rng.normal(size=(60, 3)))
        mean, covariance = fuse(values, np.linalg.inv(covariances))
        off.append(mean @ np.linalg.solve(covariance, mean))
    assert np.mean(off) == pytest.approx(3 * 57 / 54, abs=0.6)  # Hotelling's T^2 of 3 unknowns; 300 draws


def test_a_temporal_filter_of_the_camera_is_told(frames, swept, box, found):
    assert found.status == "ok"
    last, filtered = frames[0].depth, []
    for frame in frames[:60]:
        near = (frame.depth > 0) & (np.abs(frame.depth - last) < 0.02)
        last = np.where(near, 0.4 * frame.depth + 0.6 * last, frame.depth).astype(np.float32)
        filtered.append(frame.replace(depth=last))
    told = st.calibrate_intrinsics(filtered, box, GUESS, swept.ground_truth[0][0])
    assert told.status == "weak"
    assert "scatter" in told.reason
    assert "temporal" in told.reason
