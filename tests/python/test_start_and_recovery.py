# SPDX-License-Identifier: MIT
"""Starts without a pose, loss, recovery, motion, and objects that come and go."""

import re

import numpy as np
import pytest
from live_scene import box_of
from tracking_scene import CAMERA, NOISE_M, POSE, WALL_M, wall_frame

import sdftrack as st
from sdftrack import geometry
from sdftrack.testing import assert_pose_close

# 1 mm of noise on some 3,000 pixels leaves 0.05 mm; a wrong place or turn is off by centimetres and tens of degrees.
FOUND_ATOL_M, FOUND_ATOL_RAD = 1e-3, np.radians(1.5)
VOXEL_M = 0.0015


def bracket():
    """An L of two boxes, 120 x 80 x 50 mm: no turn maps it to itself."""
    origin = np.array([-0.09, -0.07, -0.055])
    n = np.ceil(-2 * origin / VOXEL_M).astype(int)
    z, y, x = np.meshgrid(*(np.arange(k) for k in n[::-1]), indexing="ij")
    p = origin + VOXEL_M * np.stack([x, y, z], -1)

    def box(centre, size):
        d = np.abs(p - centre) - 0.5 * np.array(size)
        return np.linalg.norm(np.maximum(d, 0), axis=-1) + np.minimum(d.max(-1), 0)

    values = np.minimum(
        box([0, -0.025, 0], [0.12, 0.03, 0.05]), box([-0.04, 0.01, -0.005], [0.04, 0.06, 0.04])
    )
    return st.SDF(values.astype(np.float32), VOXEL_M, origin)


@pytest.fixture(scope="module")
def body():
    return bracket()


@pytest.fixture
def tracker(body):
    return st.Tracker(body, CAMERA, threads=1)


def shot(body, T, seed=0, timestamp=None, cover=None):
    """A frame of the body before a wall, and its mask; `cover` (rows, columns) is hidden by something nearer."""
    depth = body.render(CAMERA, T)[0]
    mask = depth > 0
    noisy = depth + np.random.default_rng(seed).normal(0, NOISE_M, depth.shape)
    image = np.where(mask, noisy, WALL_M).astype(np.float32)
    if cover is not None:
        image[cover] = 0.25
        mask[cover] = False
    return st.Frame(image, timestamp=timestamp), mask


TURNS = [[0.5, -0.6, 0.2], [-0.6, 0.7, 2.5], [2.6, 0.4, 0.3]]


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("how", ["masks", "boxes", "nothing"])
def test_an_object_is_found_without_a_pose(tracker, body, how, turn):
    truth = geometry.pose(turn, [0.05, 0.03, 0.6])
    frame, mask = shot(body, truth)
    given = {"masks": {"masks": mask}, "boxes": {"boxes": [box_of(mask, 12)]}, "nothing": {}}[how]
    result = tracker.start(frame, **given)
    assert result.status == ["ok"]
    assert result.index == 0
    assert_pose_close(result.pose, truth, FOUND_ATOL_M, FOUND_ATOL_RAD)
    assert 0 < result.runner_up[0] < 0.95
    next_frame, _ = shot(body, truth, seed=1)
    followed = tracker.track(next_frame)
    assert followed.ok
    assert np.isnan(followed.runner_up[0])


def test_each_object_is_found_in_its_own_mask(body):
    truth = [geometry.pose(TURNS[0], [-0.1, 0, 0.6]), geometry.pose(TURNS[1], [0.1, 0.02, 0.55])]
    frames = [shot(body, T) for T in truth]
    depth = np.minimum(frames[0][0].depth, frames[1][0].depth)
    tracker = st.Tracker([body, body], CAMERA, threads=1)
    result = tracker.start(st.Frame(depth), masks=[m for _, m in frames])
    for found, T in zip(result.poses, truth, strict=True):
        assert_pose_close(found, T, FOUND_ATOL_M, FOUND_ATOL_RAD)


@pytest.mark.parametrize("how", ["nothing", "boxes", "masks"])
def test_an_object_that_is_not_there_is_lost_and_has_no_pose(tracker, how):
    mask = np.zeros(CAMERA.shape, bool)
    mask[80:160, 100:200] = True
    given = {"masks": {"masks": [mask]}, "boxes": {"boxes": [(100, 80, 100, 80)]}, "nothing": {}}[how]
    result = tracker.start(wall_frame(), **given)
    assert result.status == ["lost"]
    assert result.reason[0]
    assert np.isnan(result.pose).all()
    assert result.confidence[0] == 0
    assert tracker.track(wall_frame()).status == ["lost"]


def test_an_unreadable_first_frame_keeps_the_place_for_the_next(tracker, body):
    frame, mask = shot(body, POSE)
    assert tracker.start(st.Frame.unreadable("torn"), masks=mask).status == ["bad_frame"]
    assert_pose_close(tracker.track(frame).pose, POSE, FOUND_ATOL_M, FOUND_ATOL_RAD)


# --- loss and recovery
ELSEWHERE = geometry.pose(TURNS[1], [-0.12, 0.05, 0.7])


def run_until_found(tracker, body, frames=10):
    for i in range(frames):
        frame, _ = shot(body, ELSEWHERE, seed=10 + i)
        result = tracker.track(frame)
        if result.ok:
            return i, result
    return None, result


def test_a_lost_object_is_found_elsewhere_by_itself(tracker, body):
    first = tracker.start(shot(body, POSE)[0], poses=POSE)
    assert first.ok
    for _ in range(15):
        gone = tracker.track(wall_frame())
        assert gone.status == ["lost"]
        np.testing.assert_array_equal(gone.pose, first.pose)
    frames, result = run_until_found(tracker, body)
    assert frames is not None
    assert_pose_close(result.pose, ELSEWHERE, FOUND_ATOL_M, FOUND_ATOL_RAD)


@pytest.mark.parametrize(("evidence", "learns"), [(0.7, False), (0.97, True)])
def test_colours_are_learned_only_from_a_find_that_has_proved_itself(body, evidence, learns):
    frame, mask = shot(body, POSE)
    frame = st.Frame(
        frame.depth, color=np.where(mask[..., None], [200, 40, 40], [40, 60, 200]).astype(np.uint8)
    )
    sure = st.Tracker(body, CAMERA, search_odds=1.0, threads=1).start(frame).confidence[0]
    odds = evidence / (1 - evidence) * (1 - sure) / sure
    tracker = st.Tracker(body, CAMERA, search_odds=odds, threads=1)
    assert tracker.start(frame).status == ["ok"]
    for _ in range(3):
        assert tracker.track(frame).status == ["ok"]
        assert tracker.mode_used == ["rgbd" if learns else "depth"]


def test_without_recovery_a_lost_object_waits_for_recover(body):
    tracker = st.Tracker(body, CAMERA, threads=1, recover=False)
    tracker.start(shot(body, POSE)[0], poses=POSE)
    tracker.track(wall_frame())
    frames, result = run_until_found(tracker, body)
    assert frames is None
    frame, mask = shot(body, ELSEWHERE)
    assert tracker.track(frame).status == ["lost"]
    for given in ({}, {"mask": mask}, {"box": box_of(mask, 12)}, {"k": 0}):
        tracker.start(shot(body, POSE)[0], poses=POSE)
        tracker.track(frame)
        result = tracker.recover(frame, **given)
        assert result.ok
        assert result.index == 1
        assert_pose_close(result.pose, ELSEWHERE, FOUND_ATOL_M, FOUND_ATOL_RAD)
        assert tracker.track(frame).ok


def test_recover_leaves_the_followed_objects_as_they_are(body):
    other = geometry.pose(TURNS[2], [0.12, -0.03, 0.6])
    both = np.minimum(shot(body, POSE)[0].depth, shot(body, other)[0].depth)
    tracker = st.Tracker([body, body], CAMERA, threads=1, recover=False)
    tracker.start(st.Frame(both), poses=[POSE, other])
    moved = np.minimum(shot(body, ELSEWHERE)[0].depth, shot(body, other)[0].depth)
    before = tracker.track(st.Frame(moved))
    assert [s == "lost" for s in before.status] == [True, False]
    after = tracker.recover(st.Frame(moved))
    assert_pose_close(after.poses[0], ELSEWHERE, FOUND_ATOL_M, FOUND_ATOL_RAD)
    np.testing.assert_array_equal(after.poses[1], before.poses[1])
    assert tracker.recover(st.Frame(moved)) is after  # nothing is lost: nothing to do


# --- motion
def first_scales(body, motion, xs):
    """Scale (m) of the first stage in each frame of an object that is moved along x."""
    tracker = st.Tracker(body, CAMERA, threads=1, motion=motion)
    scales = []
    for i, x in enumerate(xs):
        T = geometry.pose([0.5, -0.6, 0.2], [x, 0.01, 0.5])
        frame, _ = shot(body, T, seed=i, timestamp=i / 30)
        result = tracker.start(frame, poses=T) if i == 0 else tracker.track(frame)
        assert st.metrics.pose_error(result.pose, T)[0] < FOUND_ATOL_M
        scales.append(result.steps[0][0].scale_m)
    return np.array(scales)


def test_the_prediction_that_has_been_nearer_is_used(body):
    """The scale of the first stage is half of the error of the prediction, 2.5 mm where that is small."""
    along = -0.1 + 0.02 * np.arange(12)
    swift = first_scales(body, "adaptive", along)
    assert np.all(swift[-3:] < 0.0045)
    assert np.all(first_scales(body, "static", along)[-3:] > 0.009)
    # Back and forth: what it did in the last frame, it does not do in the next one.
    shaken = 0.01 * (-1.0) ** np.arange(12)
    still = first_scales(body, "static", shaken)
    np.testing.assert_allclose(first_scales(body, "adaptive", shaken)[-3:], still[-3:], rtol=0.05)
    assert np.all(first_scales(body, "constant_velocity", shaken)[-3:] > 1.5 * still[-3:])


# --- priors, coming and going
def test_a_prior_holds_the_direction_that_the_data_leave_free():
    """A cylinder seen from the side turns freely about its axis: only a prior says how far it has turned."""
    can = st.SDF.cylinder(0.03, 0.1, voxels=80)
    T = geometry.pose([np.pi / 2, 0, 0], [0, 0, 0.5])
    frame, _ = shot(can, T)
    turned = T @ geometry.pose([0, 0, 0.2], [0.004, 0, 0])
    for sd in (1e-3, 3.0):
        tracker = st.Tracker(can, CAMERA, threads=1)
        tracker.start(frame, poses=T)
        tracker.set_pose(0, turned, covariance=np.diag([1e-4] * 3 + [sd**2] * 3))
        found = tracker.track(frame).pose
        axis_error = np.linalg.norm(found[:3, 3] - T[:3, 3])
        assert axis_error < 1e-3  # the data win where there are any
        spin = np.arctan2(*(T[:3, :3].T @ found[:3, :3])[[1, 0], [0, 0]])
        if sd < 1:
            assert spin == pytest.approx(0.2, abs=0.01)


def test_a_tight_prior_outweighs_the_data_in_camera_axes(tracker, body):
    """A covariance is of the object's origin in camera axes: x is held, z is left to the data."""
    frame, _ = shot(body, POSE)
    tracker.start(frame, poses=POSE)
    off = POSE.copy()
    off[:3, 3] += [0.002, 0, 0.002]
    tracker.set_pose(0, off, covariance=np.diag([1e-12, 1e-2, 1e-2, 1, 1, 1]))
    found = tracker.track(frame).pose
    assert found[0, 3] == pytest.approx(off[0, 3], abs=2e-5)
    assert found[2, 3] == pytest.approx(POSE[2, 3], abs=1.5e-3)
    assert_pose_close(tracker.track(frame).pose, POSE, FOUND_ATOL_M, FOUND_ATOL_RAD)  # for one frame only


def test_objects_are_added_and_removed(tracker, body):
    other = geometry.pose(TURNS[2], [0.12, -0.03, 0.6])
    single, _ = shot(body, POSE)
    both = st.Frame(np.minimum(single.depth, shot(body, other)[0].depth))
    mask = shot(body, other)[1]
    tracker.start(single, poses=POSE)
    for place in ({"pose": other}, {"mask": mask}, {"box": box_of(mask, 12)}):
        k = tracker.add(body, name="second", **place)
        assert k == 1
        assert tracker.names == ["object 0", "second"]
        result = tracker.track(both)
        assert result.poses.shape == (2, 4, 4)
        assert_pose_close(result.poses[1], other, FOUND_ATOL_M, FOUND_ATOL_RAD)
        assert_pose_close(result.poses[0], POSE, FOUND_ATOL_M, FOUND_ATOL_RAD)
        tracker.remove(1)
        assert_pose_close(tracker.track(both).pose, POSE, FOUND_ATOL_M, FOUND_ATOL_RAD)
    tracker.add(body, pose=other)
    tracker.remove(0)
    assert_pose_close(tracker.track(both).pose, other, FOUND_ATOL_M, FOUND_ATOL_RAD)


@pytest.mark.parametrize(
    ("factor", "how"), [(5.0, "masks"), (5.0, "boxes"), (0.25, "masks"), (0.25, "boxes"), (0.25, "clicks")]
)
def test_a_failed_start_names_a_depth_of_another_unit(body, factor, how):
    words = "in millimetres and read as .*1/4000 m" if factor < 1 else "in 1/5000 m .*read as millimetres"
    frame, mask = shot(body, POSE)
    other = st.Frame(frame.depth * np.float32(factor))
    row, column = np.nonzero(mask)
    place = {"masks": mask, "boxes": box_of(mask, 12), "clicks": (column.mean(), row.mean())}[how]
    try:
        result = st.Tracker(body, CAMERA).start(other, **{how: place})
        assert result.status[0] != "ok"
        said = result.reason[0]
    except ValueError as error:
        said = str(error)
    assert re.search(f"of the mesh: is the depth {words}", said), said


def test_no_size_is_named_where_it_is_right_or_the_object_is_cut_by_the_border(body):
    frame, mask = shot(body, POSE)
    assert st.Tracker(body, CAMERA).start(frame, masks=mask).reason == [""]
    corner = np.zeros_like(mask)
    corner[:12, :12] = True
    assert "of the mesh" not in st.Tracker(body, CAMERA).start(frame, masks=corner).reason[0]


IN_FRONT = (r"behind the camera \(z = -", "OpenCV", "OpenGL")
IN_METRES = ("m away", "metres are expected", "is it in millimetres")
GL_AXES = np.diag([1.0, -1, -1, 1])


def in_unit(factor):
    return np.array([[1, 1, 1, factor]] * 3 + [[1, 1, 1, 1]])


CONVENTIONS = {
    "OpenGL": (GL_AXES @ POSE, IN_FRONT),
    "millimetres": (POSE * in_unit(1e3), IN_METRES),
    "centimetres": (POSE * in_unit(1e2), ("m away", "is it in centimetres")),
    "both": ((GL_AXES @ POSE) * in_unit(1e3), (*IN_FRONT, "is it in millimetres")),
}


@pytest.mark.parametrize("way", ["start", "set_pose", "add", "one of two", "rgb"])
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_pose_in_another_convention_is_lost_with_that_reason(body, convention, way):
    T, words = CONVENTIONS[convention]
    frame, mask = shot(body, POSE)
    tracker = st.Tracker([body, body] if way == "one of two" else body, CAMERA, recover=False)
    if way == "start":
        result = tracker.start(frame, poses=T)
    elif way == "one of two":
        result = tracker.start(frame, poses=[POSE, T])
        assert result.status[0] == "ok"
    elif way == "set_pose":
        tracker.start(frame, poses=POSE)
        tracker.set_pose(0, T)
        result = tracker.track(frame)
    elif way == "add":
        tracker.start(frame, poses=POSE)
        tracker.add(body, pose=T)
        result = tracker.track(frame)
    else:
        color = np.where(mask[..., None], np.uint8(200), np.uint8(40)) * np.ones(3, np.uint8)
        result = st.Tracker(body, CAMERA, mode="rgb").start(st.Frame(None, color), poses=T)
    assert result.status[-1] in ("lost", "bad_frame")
    for word in words:
        assert re.search(word, result.reason[-1]), result.reason[-1]


def test_a_pose_beside_the_image_is_lost_as_such_and_found_when_it_comes_in(body):
    beside = geometry.pose([0.5, -0.6, 0.2], [0.9, 0.02, 0.5])
    tracker = st.Tracker(body, CAMERA)
    assert tracker.start(wall_frame(), poses=beside).reason == ["the last pose lies outside the image"]
    for i in range(8):
        result = tracker.track(shot(body, POSE, seed=i)[0])
    assert_pose_close(result.pose, POSE, atol_m=FOUND_ATOL_M, atol_rad=FOUND_ATOL_RAD)
