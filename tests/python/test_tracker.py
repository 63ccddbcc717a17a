# SPDX-License-Identifier: MIT
"""The tracker on synthetic frames with known poses: accuracy, trust, covariance, bookkeeping, bad input."""

import dataclasses
import pickle
import threading

import numpy as np
import pytest
from tracking_scene import CAMERA, NOISE_M, POSE, SIZE_M, box_mesh, depth_of, frame_of, wall_frame

import sdftrack as st
from experiments.trust.coverage import error_vector
from reference import energies as twin
from reference import tracking as twin_tracking
from sdftrack import geometry
from sdftrack.testing import assert_pose_close

# Some 4,000 pixels of 1 mm noise leave 0.03 mm and 0.7 mrad (the covariance says so too); four times that.
NOISY_ATOL_M, NOISY_ATOL_RAD = 1.2e-4, 3e-3
# Without noise: what 1.7 mm voxels round off at the edges of the box; measured 6e-6 m, 3e-5 rad.
CLEAN_ATOL_M, CLEAN_ATOL_RAD = 2e-5, 1e-4


@pytest.fixture(scope="module")
def box():
    return st.SDF.box(SIZE_M, voxels=100)


@pytest.fixture
def tracker(box):
    return st.Tracker(box, CAMERA, threads=1)


def shifted(T, *t_m):
    moved = T.copy()
    moved[:3, 3] += t_m
    return moved


# --- tracking with truth
@pytest.mark.parametrize(
    ("noise", "atol_m", "atol_rad"),
    [(None, CLEAN_ATOL_M, CLEAN_ATOL_RAD), (NOISE_M, NOISY_ATOL_M, NOISY_ATOL_RAD)],
)
@pytest.mark.parametrize("clutter", [None, "wall"])
def test_a_moving_box_is_followed(tracker, noise, atol_m, atol_rad, clutter):
    walk = st.synth.random_walk(step_m=0.005, step_rad=np.radians(1.5), distance_m=0.5)
    seq = st.synth.sequence(box_mesh(), 12, walk, noise, seed=2, camera=CAMERA, clutter=clutter, color=False)
    results = [tracker.start(seq[0], poses=[seq.ground_truth[0][0]])]
    results += [tracker.track(seq[i]) for i in range(1, len(seq))]
    for i, result in enumerate(results):
        assert result.ok
        assert result.index == i
        assert_pose_close(result.pose, seq.ground_truth[i][0], atol_m, atol_rad)


@pytest.mark.parametrize("seed", range(12))
def test_any_view_is_found_from_18_mm_and_6_degrees_off(box, seed):
    rng = np.random.default_rng(seed)
    turn, push, view = (v / np.linalg.norm(v) for v in rng.normal(size=(3, 3)))
    T = geometry.pose(rng.uniform(0, 3) * view, [*rng.uniform(-0.05, 0.05, 2), 0.5])
    off = T @ geometry.pose(np.radians(6) * turn)
    off[:3, 3] += 0.018 * push
    result = st.Tracker(box, CAMERA, threads=1).start(frame_of(T, seed=seed), poses=[off])
    assert result.ok or "is not observed" in result.reason[0]
    # A view of one face leaves the slide along it to the edges of the voxels: a third of 1.7 mm.
    assert_pose_close(result.pose, T, 6e-4, 0.01)


def test_the_scale_of_the_last_stage_follows_the_noise_that_is_there(box):
    for sigma in (0.0005, 0.003):  # 0.001 is stated
        tracker = st.Tracker(box, CAMERA, threads=1)
        result = tracker.start(frame_of(noise_m=sigma), poses=[POSE])
        for seed in range(1, 4):
            result = tracker.track(frame_of(noise_m=sigma, seed=seed))
        expected = tracker.options.scale_per_noise * sigma
        # The median of 4,000 residuals is known to 2 %; pixels at edges add some.
        assert result.steps[0][-1].scale_m == pytest.approx(expected, rel=0.08)
    fixed = st.Tracker(box, CAMERA, threads=1, adapt_noise=False)
    result = fixed.start(frame_of(noise_m=0.003), poses=[POSE])
    stated = fixed.options.scale_per_noise * fixed.options.noise_m
    assert result.steps[0][-1].scale_m == pytest.approx(stated, rel=1e-6)


def test_the_budgets_of_pixels_are_kept(box):
    tracker = st.Tracker(box, CAMERA, threads=1, max_pixels=700, coarse_pixels=100)
    result = tracker.start(frame_of(), poses=[POSE])
    pixels = [s.pixels for s in result.steps[0]]
    # Two attempts, without coarse stages and with them, each from few to all.
    second = next(i for i in range(1, len(pixels)) if pixels[i] < pixels[i - 1])
    for attempt in (pixels[:second], pixels[second:]):
        assert attempt == sorted(attempt)
        assert attempt[-1] == 700
    assert 100 in (pixels[0], pixels[second])
    assert_pose_close(result.pose, POSE, 3 * NOISY_ATOL_M, 3 * NOISY_ATOL_RAD)  # a sixth of the pixels


def test_a_few_measurements_are_no_object(box):
    depth = np.array(frame_of().depth)
    v, u = np.nonzero((depth > 0) & (depth < 1))
    depth[:] = 0
    depth[v[:30], u[:30]] = 0.5
    result = st.Tracker(box, CAMERA, threads=1).start(st.Frame(depth), poses=[POSE])
    assert result.status == ["lost"]
    assert "few depth measurements" in result.reason[0]


@pytest.mark.parametrize("k1", [0.25, -0.15])
@pytest.mark.parametrize("free_space_weight", [1.0, 10.0])
def test_a_distorted_lens_is_no_hindrance(box, k1, free_space_weight):
    camera = dataclasses.replace(CAMERA, distortion=(k1, 0.0, 1e-3, -1e-3, 0.0))  # some 4 px there
    T = shifted(POSE, 0.19, 0.08, 0)
    tracker = st.Tracker(box, camera, threads=1, free_space_weight=free_space_weight)
    result = tracker.start(frame_of(T, camera=camera), poses=[T])
    assert_pose_close(result.pose, T, NOISY_ATOL_M, NOISY_ATOL_RAD)


def test_the_mask_of_a_frame_keeps_clutter_out(tracker):
    depth = depth_of()
    on_box = depth < 1
    depth[120:] = 0.45  # a shelf in front of the lower half
    mask = on_box & (np.arange(len(depth))[:, None] < 120)
    result = tracker.start(st.Frame(depth, mask=mask), poses=[POSE])
    assert_pose_close(result.pose, POSE, 2 * NOISY_ATOL_M, 2 * NOISY_ATOL_RAD)  # half of the pixels


def test_a_frames_own_camera_goes_before_the_trackers(box):
    other = st.Camera(fx=200, fy=210, cx=150, cy=110, width=320, height=240)
    tracker = st.Tracker(box, CAMERA, threads=1)
    frame = st.Frame(depth_of(camera=other), camera=other)
    assert_pose_close(tracker.start(frame, poses=[POSE]).pose, POSE, NOISY_ATOL_M, NOISY_ATOL_RAD)
    assert_pose_close(tracker.track(frame_of()).pose, POSE, NOISY_ATOL_M, NOISY_ATOL_RAD)  # and back


# --- trust
def test_something_else_at_the_objects_place_is_not_the_object(box):
    ball = st.SDF.sphere(0.03, voxels=50).render(CAMERA, POSE)[0]
    frame = st.Frame(np.where(ball > 0, ball, 1.2).astype(np.float32))
    result = st.Tracker(box, CAMERA, threads=1).start(frame, poses=[POSE])
    assert not result.ok
    assert result.confidence[0] < 0.3


def test_a_partly_hidden_object_is_followed_and_a_mostly_hidden_one_is_not_called_sure(tracker):
    depth = depth_of()
    columns = np.nonzero((depth < 1).any(axis=0))[0]
    confidence = []
    for share in (0.0, 0.2, 0.8):
        hidden = depth.copy()
        hidden[:, : columns[0] + int(share * len(columns))] = 0.3
        result = tracker.start(st.Frame(hidden), poses=[POSE])
        confidence.append(result.confidence[0])
        if share < 0.5:
            assert_pose_close(result.pose, POSE, 2 * NOISY_ATOL_M, 2 * NOISY_ATOL_RAD)
    assert confidence[0] > 0.9
    assert confidence[2] < 0.5
    assert confidence[1] < confidence[0] + 1e-4  # both are sure to a few 1e-4
    assert confidence[2] < confidence[1]
    assert not result.ok
    assert result.reason[0]


# --- covariance
DRAWS = 100
MOVING_FRAMES = 96
CHI2_95, CHI2_99_9 = 12.592, 22.458  # 6 degrees of freedom
# 95 of 100 draws are expected inside, sd 2.2; three of them.
MIN_COVERED = 0.88
# The sd of an sd from 100 draws is 7 %, three of them; and the voxels' grain widens the covariance by 5 % here.
SD_RATIO = (0.74, 1.21)


def test_the_covariance_is_symmetric_positive_and_read_only(tracker):
    C = tracker.start(frame_of(), poses=[POSE]).covariance
    np.testing.assert_allclose(C, C.T, rtol=1e-9)  # of its own sums, in double
    assert np.linalg.eigvalsh(C).min() > 0
    with pytest.raises(ValueError, match="read-only"):
        C[0, 0] = 1


@pytest.mark.parametrize("correlated", [1, 4])
def test_the_covariance_is_that_of_the_error_over_draws_of_the_noise(correlated):
    shape = st.SDF.ellipsoid([0.06, 0.045, 0.03], voxels=200)
    clean = shape.render(CAMERA, POSE)[0]
    rng = np.random.default_rng(1)
    # With a correlation area of 4 px, blocks of 2 x 2 pixels share one error.
    side = int(np.sqrt(correlated))
    tracker = st.Tracker(shape, CAMERA, threads=1, correlation_area_px=correlated, max_systematic_m=0.0)
    errors, variances, inside = [], [], 0
    for _ in range(DRAWS):
        noise = rng.normal(0, 2 * NOISE_M, (CAMERA.height // side, CAMERA.width // side))
        noise = np.kron(noise, np.ones((side, side)))
        frame = st.Frame(np.where(clean > 0, clean + noise, 0).astype(np.float32))
        result = tracker.start(frame, poses=[POSE])
        e = error_vector(result.pose, POSE)
        errors.append(e)
        variances.append(np.diag(result.covariance))
        inside += e @ np.linalg.solve(result.covariance, e) < CHI2_95
    ratio = np.std(errors, axis=0) / np.sqrt(np.mean(variances, axis=0))
    assert inside / DRAWS > MIN_COVERED
    assert (ratio > SD_RATIO[0]).all()
    assert (ratio < SD_RATIO[1]).all()


@pytest.mark.parametrize("at", [[0.0, 0.0, 0.0], [0.3, -0.2, 0.1]], ids=["centred", "off centre"])
def test_the_covariance_is_that_of_the_twin(box, at):
    box = st.SDF(box.values, box.voxel_size, box.origin + np.array(at))  # the object's origin lies elsewhere
    start = POSE @ geometry.pose([0, 0, 0], -np.array(at))
    small = CAMERA.scaled(0.25)
    frame = st.Frame(depth_of(camera=small))
    # Known noise and no prior or retry: the final energy is then the data's alone, at one scale.
    tracker = st.Tracker(
        box, small, threads=1, adapt_noise=False, free_space=False, motion_sigma_m=0.0, correlation_area_px=1,
        max_systematic_m=0.0,
    )  # fmt: skip
    result = tracker.start(frame, poses=[start])
    s = result.steps[0][-1].scale_m
    shape = twin_tracking.make_shape(box.values, box.voxel_size, box.origin)
    K = [small.fx, small.fy, small.cx, small.cy]
    options = tracker.options
    T_start, T_final = (twin_tracking.centred(T, shape.centre) for T in (start, result.pose))
    rays, depths = twin_tracking.select_pixels(frame.depth, K, shape, T_start, options.padding_m)
    assert len(depths) == result.steps[0][-1].pixels
    volume = box.values, box.voxel_size, box.origin - shape.centre
    field = twin.SingleObject(*volume, T_final)
    gains = twin.classify(field, rays, depths, "ray_hit")
    penalty = twin.DepthLogistic(s, options.outlier_floor)
    sums = twin_tracking.summarize(field, rays, depths, gains, penalty, box.voxel_size)
    C = twin_tracking.increment_covariance(sums, shape.diameter)
    C = twin_tracking.camera_covariance(C, np.linalg.inv(T_final), -shape.centre)
    unit = 1 / np.sqrt(np.diag(C))
    # Some pixels at the edges are classed at the state before the last step: a few percent of the sums.
    np.testing.assert_allclose(result.covariance * np.outer(unit, unit), C * np.outer(unit, unit), atol=0.05)


def test_the_turn_of_a_sphere_has_the_variance_of_pi_and_never_0():
    ball = st.SDF.sphere(0.05, voxels=80)
    clean = ball.render(CAMERA, POSE)[0]
    noise = np.random.default_rng(0).normal(0, NOISE_M, clean.shape)
    frame = st.Frame(np.where(clean > 0, clean + noise, 0).astype(np.float32))
    result = st.Tracker(ball, CAMERA, threads=1, max_systematic_m=0.0).start(frame, poses=[POSE])
    np.testing.assert_allclose(np.diag(result.covariance)[3:], np.pi**2, rtol=0.05)
    # The voxels' grain (1.9 mm) mixes 0.1 mm per radian of position into the free turn, whose sd is pi.
    assert np.sqrt(np.diag(result.covariance)[:3]).max() < 5e-4
    assert np.linalg.eigvalsh(result.covariance).min() > 0
    assert result.confidence[0] < 0.2  # nobody knows the turn
    assert np.linalg.norm(result.pose[:3, 3] - POSE[:3, 3]) < NOISY_ATOL_M


def test_a_flat_view_leaves_the_slide_along_the_face_and_the_turn_in_it_open(box):
    facing = geometry.pose([0, 0, 0], [0, 0, 0.5])
    depth = depth_of(facing)
    mask = np.zeros(CAMERA.shape, bool)
    mask[110:130, 145:175] = True  # the middle of the front face alone
    depth[~mask] = 0
    result = st.Tracker(box, CAMERA, threads=1, max_systematic_m=0.0).start(
        st.Frame(depth, mask=mask), poses=[facing]
    )
    sd, diameter = np.sqrt(np.diag(result.covariance)), np.linalg.norm(SIZE_M)
    np.testing.assert_allclose(sd[[0, 1]], diameter, rtol=0.1)
    assert sd[5] == pytest.approx(np.pi, rel=0.05)
    assert sd[2] < 1e-3  # but the distance is known,
    assert sd[[3, 4]].max() < 0.05  # and so is the tilt


def test_while_the_object_moves_the_covariance_is_that_of_the_errors(box):
    tracker, distances = st.Tracker(box, CAMERA, threads=1, max_systematic_m=0.0), []
    for i in range(MOVING_FRAMES):
        k = abs(i % 12 - 6)  # 12 mm and 4 degrees from frame to frame, back and forth
        T = shifted(POSE, 0.01 * k, 0.006 * k, 0)
        T[:3, :3] = geometry.pose([0.03 * k, 0.05 * k, 0.04 * k])[:3, :3] @ T[:3, :3]
        frame = frame_of(T, seed=i)
        result = tracker.track(frame) if i else tracker.start(frame, poses=[T])
        e = error_vector(result.pose, T)
        distances.append(e @ np.linalg.solve(result.covariance, e))
    # Of six squares each; the mean of so many has a standard deviation of 0.35.
    assert 5.2 < np.mean(distances) < 7


@pytest.mark.parametrize("share", [0.3, 0.4, 0.5, 0.6])
def test_a_direction_that_only_edges_hold_is_not_called_sure(box, share):
    depth = depth_of()
    columns = np.nonzero((depth < 1).any(axis=0))[0]
    depth[:, : columns[0] + int(share * len(columns))] = 0.3  # the left face is hidden, at last wholly
    result = st.Tracker(box, CAMERA, threads=1).start(st.Frame(depth), poses=[POSE])
    assert result.ok or "the position along" in result.reason[0]
    e = error_vector(result.pose, POSE)
    assert e @ np.linalg.solve(result.covariance, e) < CHI2_99_9


# --- twists, set_pose, saving
def test_twists_are_velocities_in_camera_axes(tracker):
    turn = np.radians(2)
    first = tracker.start(frame_of(noise_m=0, timestamp=10.0), poses=[POSE])
    assert np.isnan(first.twists).all()
    moved = geometry.pose([0, turn, 0]) @ POSE
    moved[:3, 3] = POSE[:3, 3] + [0.004, 0, -0.002]
    second = tracker.track(frame_of(moved, noise_m=0, timestamp=10.05))
    expected = np.array([0.004, 0, -0.002, 0, turn, 0]) / 0.05
    # CLEAN_ATOL over 0.05 s
    np.testing.assert_allclose(second.twists[0], expected, atol=2 * CLEAN_ATOL_RAD / 0.05)
    assert np.isnan(tracker.track(frame_of(moved)).twists).all()  # no timestamp
    assert np.isnan(tracker.track(wall_frame()).twists).all()


def test_set_pose_moves_where_the_object_is_looked_for(box):
    tracker = st.Tracker(box, CAMERA, threads=1)
    tracker.start(frame_of(), poses=[POSE])
    elsewhere = shifted(POSE, 0.22, 0, 0)  # beyond the reach of a wide attempt
    assert not tracker.track(frame_of(elsewhere)).ok
    tracker.set_pose(0, elsewhere)
    result = tracker.track(frame_of(elsewhere))
    assert result.ok
    assert_pose_close(result.pose, elsewhere, NOISY_ATOL_M, NOISY_ATOL_RAD)


def test_a_pose_that_was_set_is_the_last_good_one(box):
    tracker = st.Tracker(box, CAMERA, threads=1)
    tracker.start(frame_of(), poses=[POSE])
    elsewhere = shifted(POSE, 0.22, 0, 0)  # beyond the reach of a wide attempt
    tracker.set_pose(0, elsewhere)
    assert_pose_close(pickle.loads(pickle.dumps(tracker)).track(wall_frame()).pose, elsewhere, 1e-12, 1e-12)
    assert_pose_close(tracker.track(st.Frame.unreadable("gone")).pose, elsewhere, 1e-12, 1e-12)
    assert_pose_close(tracker.track(wall_frame()).pose, elsewhere, 1e-12, 1e-12)


def test_results_pickle_compare_and_go_to_json(tracker):
    import json

    result = tracker.start(frame_of(), poses=[POSE])
    assert pickle.loads(pickle.dumps(result)) == result
    lost = tracker.track(wall_frame())
    assert lost != result
    data = json.loads(json.dumps(lost.to_dict(), allow_nan=False))
    assert data["status"] == ["lost"]
    assert data["covariances"][0][0][0] is None
    assert "lost" in repr(lost)


# --- options
def test_the_printed_form_tracks_too(box):
    printed = st.TrackerOptions.printed()
    assert (printed.residual, printed.curvature, printed.outlier_floor) == ("point", "printed", 0.0)
    assert (printed.stop_rule, printed.color_likelihood, printed.color_prior) == ("printed", "printed", 0.5)
    assert (printed.union_sharpness, printed.coarse_union_sharpness) == (2.0, 2.0)  # per voxel (section 5.2)
    assert not any((printed.smooth_colors, printed.outline, printed.free_space, printed.photometric))
    result = st.Tracker(box, CAMERA, threads=1, options=printed).start(
        frame_of(), poses=[shifted(POSE, 0.002, 0, 0.002)]
    )
    assert result.steps[0][0].damping == 100
    assert_pose_close(result.pose, POSE, 0.002, 0.03)  # its normal equations are poor at the minimum
    assert np.sqrt(np.diag(result.covariance)).max() < 0.01  # m, rad: a box seen from three sides is known
    assert result.confidence[0] > 0.9


def test_the_printed_rule_goes_on_where_a_step_promises_little(box):
    # From the minimum: the usual rule sees at once that nothing is to be gained.
    start = {"frame": frame_of(), "poses": [POSE]}
    steps = {
        rule: st.Tracker(box, CAMERA, threads=1, options=st.TrackerOptions.printed(), stop_rule=rule)
        .start(**start)
        .steps[0]
        for rule in ("gain", "printed")
    }
    assert len(steps["gain"]) < len(steps["printed"]) <= 100
    assert all(step.pixels > 320 for step in steps["printed"])  # all of them, in one stage


# --- bad input
def test_a_bad_first_frame_is_no_reason_to_remember_an_earlier_run(box, tracker):
    tracker.start(frame_of(), poses=POSE)
    fresh = st.Tracker(box, CAMERA, threads=1)
    for t in (fresh, tracker):
        t.start(st.Frame.unreadable("torn"), poses=POSE)
    np.testing.assert_array_equal(fresh.track(frame_of()).poses, tracker.track(frame_of()).poses)


USES = {
    "track": lambda t: t.track(frame_of()), "start": lambda t: t.start(frame_of(), poses=POSE),
    "set_pose": lambda t: t.set_pose(0, POSE), "save": pickle.dumps,
}  # fmt: skip


@pytest.mark.parametrize("use", USES)
def test_every_use_by_a_second_thread_is_refused_and_changes_nothing(tracker, use, monkeypatch):
    """The first thread is held inside `track`, so nothing here depends on timing."""
    tracker.start(frame_of(), poses=POSE)
    inside, leave = threading.Event(), threading.Event()
    finish = tracker._finish

    def slow(*args):
        inside.set()
        assert leave.wait(10)
        return finish(*args)

    monkeypatch.setattr(tracker, "_finish", slow)
    results = []
    worker = threading.Thread(target=lambda: results.append(tracker.track(frame_of())))
    worker.start()
    assert inside.wait(10)
    try:
        with pytest.raises(RuntimeError, match="another thread"):
            USES[use](tracker)
    finally:
        leave.set()
        worker.join()
    assert results[0].index == 1
    assert results[0].ok
    monkeypatch.undo()
    assert tracker.track(frame_of()).index == 2
