# SPDX-License-Identifier: MIT
"""Several objects in one tracker: fitted together where they touch, exactly alone where they do not."""

import numpy as np
import pytest
from tracking_scene import CAMERA, SIZE_M, WALL_M, depth_of

import sdftrack as st
from experiments.synth.cup import CAMERA as CUP_CAMERA
from experiments.synth.cup import PLAY_M, carried
from reference.energies import SoftMin
from sdftrack import geometry
from sdftrack.metrics import pose_error

POSE = geometry.pose([0.5, -0.6, 0.2], [0.01, 0, 0.6])
CLOSE_M, CLOSE_RAD = 3e-4, np.deg2rad(0.3)  # mean at 1 mm of noise


@pytest.fixture(scope="module")
def box():
    return st.SDF.box(SIZE_M, voxels=100)


def beside(gap_m, T=POSE):
    """The pose of a copy next to the one at T, along its shortest edge."""
    return T @ geometry.pose([0, 0, 0], [0, 0, SIZE_M[2] + gap_m])


def both(poses, seed=0):
    """A frame of boxes before a wall."""
    depths = [depth_of(T, seed=seed + k) for k, T in enumerate(poses)]
    return st.Frame(np.minimum.reduce(depths))


def penetration(shape, a, b):
    """Depth (m) of the deepest sample of one in the other."""
    points = np.asarray(shape.surface_samples(3000)[0], np.float64)
    deepest = 0.0
    for of, in_ in ((a, b), (b, a)):
        T = np.linalg.inv(in_) @ of
        deepest = max(deepest, -float(shape(geometry.transform_points(T, points)).min()))
    return deepest


def test_two_that_touch_and_part_keep_their_places_and_stay_out_of_each_other(box):
    tracker = st.Tracker([box, box], CAMERA, threads=1)
    errors = []
    gaps = [0.03, 0.02, 0.01, 0.004, 0.0005, 0.0005, 0.006, 0.015, 0.03]
    for k, gap in enumerate(gaps):
        truth = np.stack([POSE, beside(gap)])
        frame = both(truth, seed=10 * k)
        result = tracker.start(frame, poses=truth) if k == 0 else tracker.track(frame)
        assert result.status == ["ok", "ok"]
        assert penetration(box, *result.poses) < 1e-3
        errors.append(pose_error(result.poses, truth))
    metres, radians = np.array(errors).transpose(1, 0, 2)
    assert metres.mean() < CLOSE_M
    assert radians.mean() < CLOSE_RAD
    assert metres.max() < 1e-3
    assert radians.max() < np.deg2rad(1)


def test_objects_far_from_each_other_are_fitted_as_if_alone_to_the_bit(box):
    poses = [POSE, geometry.pose([0, 0, 0], [-0.22, 0, 0]) @ POSE]
    frame = both(poses)
    together = st.Tracker([box, box], CAMERA, threads=1).start(frame, poses=poses)
    for k, T in enumerate(poses):
        alone = st.Tracker(box, CAMERA, threads=1).start(frame, poses=T)
        np.testing.assert_array_equal(together.poses[k], alone.pose)
        np.testing.assert_array_equal(together.covariances[k], alone.covariance)


def test_memberships_are_the_twins_weights_and_add_up_to_one(box):
    poses = [POSE, beside(0.001)]
    tracker = st.Tracker([box, box], CAMERA, threads=1, membership=True)
    frame = both(poses)
    result = tracker.start(frame, poses=poses)
    weights = result.membership
    assert weights.shape == (*CAMERA.shape, 2)
    total = weights.sum(axis=2)
    assert np.all((np.abs(total - 1) < 1e-5) | (total == 0))
    assert total[frame.depth == np.float32(WALL_M)].max() == 0  # the wall is nobody's
    points, pixels = st.back_project(frame.depth, CAMERA)
    twin = SoftMin((), tracker.options.coarse_union_sharpness / box.voxel_size)
    for (x, y), p in list(zip(pixels, points, strict=True))[::997]:
        phis = np.array([box(geometry.transform_points(np.linalg.inv(T), p[None]))[0] for T in result.poses])
        if total[y, x] > 0 and np.abs(phis).max() < 0.009:
            np.testing.assert_allclose(weights[y, x], twin.memberships(phis), atol=2e-3)
    assert result.foreground is None  # depth alone
    assert st.Tracker([box, box], CAMERA).start(frame, poses=poses).membership is None


def test_shapes_of_very_different_voxels_go_together(box):
    fine = st.SDF.box((0.03, 0.03, 0.03), voxels=200)
    coarse = st.SDF.box(SIZE_M, voxels=40)
    on_top = POSE @ geometry.pose([0, 0, 0], [0, 0, SIZE_M[2] / 2 + 0.016])
    frame = st.Frame(np.minimum(depth_of(POSE), depth_of(on_top, size=(0.03, 0.03, 0.03), seed=3)))
    result = st.Tracker([coarse, fine], CAMERA, threads=1).start(frame, poses=[POSE, on_top])
    assert "lost" not in result.status
    metres, _ = pose_error(result.poses, np.stack([POSE, on_top]))
    assert metres.max() < 2e-3


def test_one_that_starts_out_of_view_is_lost_and_leaves_the_others_alone(box):
    away = geometry.pose([0, 0, 0], [0, 0, -2.0]) @ POSE
    result = st.Tracker([box, box], CAMERA, recover=False).start(both([POSE]), poses=[POSE, away])
    assert result.status == ["ok", "lost"]
    assert np.isfinite(result.poses).all()


def test_a_hundred_and_one_objects_on_the_data_of_one_do_not_hang_or_crash():
    small = st.SDF.box(SIZE_M, voxels=24)
    poses = [POSE @ geometry.pose([0, 0, 0], [0.0005 * k, 0, 0]) for k in range(101)]
    tracker = st.Tracker([small] * 101, CAMERA, threads=1, recover=False)
    result = tracker.start(both([POSE]), poses=poses)
    assert np.isfinite(result.poses).all()
    assert result.status.count("ok") <= 1


def test_the_energy_is_the_mean_of_the_objects_also_where_one_of_them_was_searched_for_again(box):
    poses = [POSE, geometry.pose([0, 0, 0], [-0.22, 0, 0]) @ POSE]  # too far from each other to touch
    frame, tracker = both(poses), st.Tracker([box, box], CAMERA, threads=1)
    alone = [st.Tracker(box, CAMERA, threads=1).start(frame, poses=[T]).energy for T in poses]
    assert tracker.start(frame, poses=poses).energy == pytest.approx(np.mean(alone))
    again = tracker.recover(frame, k=1).energy  # the same search finds the same,
    assert again == tracker.recover(frame, k=1).energy  # and the other object counts as before


def test_a_recording_without_noise_takes_no_more_work_than_one_with_it():
    camera = st.Camera(525, 525, 319.5, 239.5, 640, 480)
    duck = st.synth.duck_mesh()
    shape = st.SDF.from_mesh(duck, voxels=60)
    turns = np.random.default_rng(0).normal(size=(4, 3))
    starts = [geometry.pose(turn, [0.22 * (k - 2), -0.15, 1.0]) for k, turn in enumerate(turns)]

    def frame(i, noise_m):
        depth = np.full(camera.shape, 1.5, np.float32)
        for T in starts:
            moved = geometry.pose(t_m=(0.003 * np.sin(i), 0.003 * i, 0)) @ T
            seen = shape.render(camera, moved)[0]
            depth = np.where(seen > 0, np.minimum(seen, depth), depth)
        noise = np.random.default_rng(i).normal(0, 1, depth.shape) * noise_m
        return st.Frame((depth + noise).astype(np.float32))

    def work(noise_m):
        """Pixels looked at by all steps of all fits."""
        tracker = st.Tracker([shape] * 4, camera, mode="depth")
        tracker.start(frame(0, noise_m), poses=starts)
        results = [tracker.track(frame(i, noise_m)) for i in range(1, 7)]
        assert all(r.ok for r in results)
        return sum(step.pixels for r in results for steps in r.steps for step in steps)

    assert work(0.0) < 2 * work(0.001)


def carried_by(frames, **options):
    """Results and truth of a ball in a cup (Fig. 5.10), never seen itself: the cup moves, turns and tilts."""
    scene = carried(frames)
    tracker = st.Tracker(list(scene.shapes), CUP_CAMERA, **options)
    for i, (frame, truth) in enumerate(zip(scene.frames, scene.poses, strict=True)):
        yield (tracker.track(frame) if i else tracker.start(frame, poses=truth)), truth


@pytest.mark.parametrize("collision", ["contact", "printed"])
def test_a_ball_that_is_carried_in_a_cup_is_placed_in_it_although_it_is_never_seen(collision):
    for result, truth in carried_by(20, collision=collision):
        assert result.status[0] in ("ok", "weak")  # nothing shows its turn about its axis
        assert result.status[1] == "weak"
        assert "neighbouring" in result.reason[1]
        assert np.linalg.norm(result.poses[1][:3, 3] - truth[1][:3, 3]) < 0.002  # measured 0.5 and 1.1 mm
        across_m, up_m, along_m = np.sqrt(np.diag(result.covariances[1])[:3])
        for sd_m in (across_m, along_m):
            assert 0.5 * PLAY_M / np.sqrt(3) < sd_m < PLAY_M + 0.001  # an even distribution over the play
        assert (
            0.028 < up_m < 0.062
        )  # nothing bounds it there: an even 52 mm, and twice that after some frames


def test_carried_frames_limit_how_long_an_object_is_placed_by_others():
    said = [result.status[1] for result, _ in carried_by(6, carried_frames=3, recover=False)]
    assert said == ["weak"] * 3 + ["lost"] * 3


def test_what_stands_beside_another_is_not_held_by_it(box):
    """A neighbour on one side bounds one direction: the hidden object is lost after five frames."""
    tracker = st.Tracker([box, box], CAMERA, recover=False)
    truth = np.stack([POSE, beside(0.003)])
    tracker.start(both(truth), poses=truth)
    said = []
    for i in range(1, 8):
        first, second = depth_of(truth[0], seed=i), depth_of(truth[1], seed=50 + i)
        depth = np.where(second < first, np.float32(0.35), first)  # a board before all that it shows
        said.append(tracker.track(st.Frame(depth)).status[1])
    assert said[:5] == ["weak"] * 5
    assert said[5:] == ["lost"] * 2
