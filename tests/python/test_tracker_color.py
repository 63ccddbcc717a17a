# SPDX-License-Identifier: MIT
"""Tracking by depth and colour: what colour brings, when it is used, and what is refused."""

import logging
from statistics import NormalDist

import numpy as np
import pytest
from tracking_scene import CAMERA, POSE, SIZE_M, box_mesh, depth_of

import sdftrack as st
from sdftrack import geometry
from sdftrack.metrics import pose_error

RED, BLUE, GREEN = (190, 50, 40), (40, 60, 180), (60, 170, 60)
# Noise of 1 mm over some 3,000 pixels moves the pose by 0.05 mm; a hand that pulls does so by millimetres.
CLOSE_M, CLOSE_RAD = 0.0006, np.radians(0.6)
# Colours that say nothing give the posterior 0.7 up to float32, and with it the same steps up to rounding.
SAME_M = 1e-6


@pytest.fixture(scope="module")
def box():
    return st.SDF.box(SIZE_M)


def moved(i):
    return geometry.pose([0.004 * i, 0.006 * i, 0], [0.002 * i, 0.001 * i, 0]) @ POSE


def picture(T, front=RED, back=BLUE, seed=0, noise=6.0):
    """Colour image of the box before the wall."""
    seen = box_mesh().raycast(CAMERA, T)[0] > 0
    image = np.where(seen[..., None], front, back) + np.random.default_rng([seed, 9]).normal(
        0, noise, (*seen.shape, 3)
    )
    return np.clip(image, 0, 255).astype(np.uint8)


def pair(i, **colors):
    return st.Frame(depth_of(moved(i), seed=i), picture(moved(i), seed=i, **colors), timestamp=i / 30)


def cover(frame, i, share, color, thickness_m=0.004):
    """Something thin of the given colour lies on the right part of what is seen of the box."""
    seen = box_mesh().raycast(CAMERA, moved(i))[0] > 0
    columns = np.flatnonzero(seen.any(axis=0))
    on = seen & (np.arange(seen.shape[1]) >= columns[int((1 - share) * (len(columns) - 1))])
    depth, image = frame.depth.copy(), frame.color.copy()
    depth[on] -= thickness_m
    image[on] = color
    return frame.replace(depth=depth, color=image)


def followed(tracker, frames):
    results = [tracker.start(frames[0], poses=POSE)]
    return results + [tracker.track(f) for f in frames[1:]]


def test_colour_keeps_the_pose_where_something_thin_lies_on_the_object(box):
    """Much of what is seen is 4 mm too near, in the background's colour: depth is drawn, colour is not."""
    frames = [pair(i) if i < 3 else cover(pair(i), i, 0.4, BLUE) for i in range(8)]
    errors = {}
    for mode in ("depth", "rgbd"):
        results = followed(st.Tracker(box, CAMERA, mode=mode), frames)
        errors[mode] = pose_error(results[-1].pose, moved(7))
        if mode == "rgbd":
            assert results[-1].status[0] in ("ok", "weak")
    assert errors["rgbd"][0] < CLOSE_M
    assert errors["rgbd"][1] < CLOSE_RAD
    assert errors["depth"][0] > 3 * errors["rgbd"][0]


@pytest.mark.parametrize("likelihood", ["odds", "printed"])
def test_both_likelihoods_follow_the_object(box, likelihood):
    results = followed(st.Tracker(box, CAMERA, color_likelihood=likelihood), [pair(i) for i in range(5)])
    for i, result in enumerate(results):
        metres, radians = pose_error(result.pose, moved(i))
        assert result.ok
        assert metres < CLOSE_M
        assert radians < CLOSE_RAD


def test_the_printed_likelihood_moves_the_pose_away_from_the_camera(box):
    """Measurements in front of the surface count less than those behind it: with alike colours, much less."""
    away_m = {}
    for likelihood in ("odds", "printed"):
        tracker = st.Tracker(box, CAMERA, mode="rgbd", color_likelihood=likelihood, noise_m=0.00316)
        poses = []
        for i in range(8):
            image = picture(POSE, (120, 90, 80), (100, 105, 95), seed=i, noise=20)
            frame = st.Frame(depth_of(POSE, seed=i, noise_m=0.00316), image, timestamp=i / 30)
            poses.append((tracker.track(frame) if i else tracker.start(frame, poses=POSE)).pose)
        away_m[likelihood] = np.mean([T[2, 3] - POSE[2, 3] for T in poses[1:]])
    assert abs(away_m["odds"]) < 0.0001
    assert 0.0002 < away_m["printed"] < 0.0006  # measured 0.0004


def plane_costs(away_mm, share, s_mm=2.0):
    """Mean of -log L of a plane seen with noise of 1 mm that is put `away_mm` too far, and log eta to be added."""
    noise_mm = NormalDist().inv_cdf
    phi = away_mm - np.array([noise_mm((i + 0.5) / 20000) for i in range(20000)])
    on = np.cosh(phi / (2 * s_mm)) ** -2.0
    off = np.where(phi >= 0, 1 - on, 0)
    return -np.log(share * on + (1 - share) * off).mean(), np.log((on + off).mean())


def test_the_normaliser_that_the_thesis_drops_depends_on_the_pose():
    """eta of Eqs. 4.14 and 5.12 is not constant: with it the bias of the printed form points the other way."""
    away_mm = np.arange(-1.5, 1.5, 0.01)
    printed, log_eta = np.array([plane_costs(z, 0.75) for z in away_mm]).T
    assert np.ptp(log_eta) > 0.1
    assert away_mm[np.argmin(printed)] == pytest.approx(0.18, abs=0.015)
    assert away_mm[np.argmin(printed + log_eta)] == pytest.approx(-0.80, abs=0.015)


def test_auto_falls_back_to_depth_where_colours_say_nothing_and_says_so(box, caplog):
    tracker = st.Tracker(box, CAMERA)
    with caplog.at_level(logging.INFO, logger="sdftrack"):
        followed(tracker, [pair(i) for i in range(2)])
        assert tracker.mode_used == ["rgbd"]
        tracker.start(pair(0, front=GREEN, back=GREEN), poses=POSE)
        alike = tracker.track(pair(1, front=GREEN, back=GREEN))
    assert tracker.mode_used == ["depth"]
    assert alike.ok
    assert [r.message for r in caplog.records] == [
        "frame 1: object 0 is tracked by rgbd",
        "frame 0: object 0 is tracked by depth",
    ]
    always = st.Tracker(box, CAMERA, mode="rgbd")
    followed(always, [pair(i, front=GREEN, back=GREEN) for i in range(2)])
    assert always.mode_used == ["rgbd"]


def test_auto_without_colour_images_and_depth_mode_with_them_are_the_same(box):
    frames = [pair(i) for i in range(4)]
    plain = [st.Frame(f.depth, timestamp=f.timestamp) for f in frames]
    by_depth = followed(st.Tracker(box, CAMERA, mode="depth"), frames)
    without = followed(st.Tracker(box, CAMERA), plain)
    for a, b in zip(by_depth, without, strict=True):
        np.testing.assert_array_equal(a.poses, b.poses)


def test_colours_that_say_nothing_change_nothing(box):
    frames = [pair(i, front=GREEN, back=GREEN, noise=0.0) for i in range(4)]
    by_color = followed(st.Tracker(box, CAMERA, mode="rgbd"), frames)
    by_depth = followed(st.Tracker(box, CAMERA, mode="depth"), frames)
    for a, b in zip(by_color, by_depth, strict=True):
        assert pose_error(a.pose, b.pose)[0] < SAME_M


def test_a_frame_without_colour_in_between_is_tracked_by_depth(box):
    tracker = st.Tracker(box, CAMERA)
    followed(tracker, [pair(0), pair(1)])
    assert tracker.track(st.Frame(pair(2).depth, timestamp=2 / 30)).ok
    assert tracker.mode_used == ["depth"]
    assert tracker.track(pair(3)).ok
    assert tracker.mode_used == ["rgbd"]


def test_a_doubtful_frame_teaches_no_colours(box):
    """While the object is gone its place shows green; were that learnt, green would count as the object's."""
    tracker = st.Tracker(box, CAMERA, recover=False)
    followed(tracker, [pair(0), pair(1)])
    wall = np.full(CAMERA.shape, 1.2, np.float32)
    for i in range(2, 12):
        gone = tracker.track(st.Frame(wall, picture(POSE, front=GREEN), timestamp=i / 30))
        assert not gone.ok
    other = st.Tracker(box, CAMERA, recover=False)
    followed(other, [pair(0), pair(1)])
    for t in (tracker, other):
        t.set_pose(0, moved(2))
    a, b = tracker.track(pair(2)), other.track(pair(2))
    assert tracker.mode_used == ["rgbd"]
    assert pose_error(a.pose, b.pose)[0] < SAME_M


def test_an_unregistered_pair_does_as_well_as_an_aligned_one(box):
    """Colour seen 60 mm beside the depth camera, by a camera with other intrinsics and a lens."""
    color_camera = st.Camera(
        fx=300, fy=300, cx=199.5, cy=149.5, width=400, height=300, distortion=[0.05, -0.1, 0, 0]
    )
    T = geometry.pose([0, 0.05, 0], [-0.06, 0, 0])
    rig = st.RGBDCamera(CAMERA, color_camera, T_color_depth=T)
    pinhole = st.Camera(fx=300, fy=300, cx=199.5, cy=149.5, width=400, height=300)
    P = pinhole.K @ T[:3, :3] @ np.linalg.inv(CAMERA.K)
    pair_rig = st.RGBDCamera(CAMERA, pinhole, projective=(P, pinhole.K @ T[:3, 3]))

    def frames(camera):
        for i in range(8):
            seen = box_mesh().raycast(camera, T @ moved(i))[0] > 0
            image = np.where(seen[..., None], RED, BLUE).astype(np.uint8)
            depth = depth_of(moved(i), seed=i)
            if i >= 3:  # the aligned pair's thin cover, entered where the colour camera sees it
                front = box_mesh().raycast(CAMERA, moved(i))[0] > 0
                columns = np.flatnonzero(front.any(axis=0))
                on = front & (np.arange(320) >= columns[len(columns) // 2])
                depth[on] -= 0.004
                points = CAMERA.back_project(depth)[on]
                px = np.rint(st.RGBDCamera(CAMERA, camera, T_color_depth=T).project_to_color(points)).astype(
                    int
                )
                for dx in (-1, 0, 1):
                    image[px[:, 1], px[:, 0] + dx] = BLUE
            yield st.Frame(depth, image, timestamp=i / 30)

    for camera, lens in ((rig, color_camera), (pair_rig, pinhole)):
        tracker = st.Tracker(box, camera, mode="rgbd")
        results = followed(tracker, list(frames(lens)))
        metres, radians = pose_error(results[-1].pose, moved(7))
        assert metres < CLOSE_M
        assert radians < CLOSE_RAD
        assert tracker.mode_used == ["rgbd"]
