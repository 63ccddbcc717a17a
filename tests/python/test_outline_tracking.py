# SPDX-License-Identifier: MIT
"""The outline in the colour image in a tracker: depth that is biased, frames without depth, colour alone."""

import numpy as np
import pytest
from tracking_scene import CAMERA, box_mesh

import sdftrack as st
from sdftrack import geometry

OBJECT, AROUND = np.array([200, 40, 40], np.uint8), np.array([40, 60, 180], np.uint8)
BOX = box_mesh()
VOLUME = st.SDF.from_mesh(BOX, 100)


def bent(d, T, random, tilt_m, bulge_m):
    """Depth of the box at T that errs: by noise, a tilt from one end to the other, and a bulge."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    p = np.stack([(u - CAMERA.cx) / CAMERA.fx * d, (v - CAMERA.cy) / CAMERA.fy * d, d], -1)
    q = (p - T[:3, 3]) @ T[:3, :3]
    noisy = d + random.normal(0, 0.001, d.shape)
    return noisy + tilt_m * q[..., 0] / 0.06 - bulge_m * (np.hypot(q[..., 0], q[..., 1]) / 0.06) ** 2


def scene(count, tilt_m=0.0, bulge_m=0.0, distances_m=None):
    """A box that turns and moves before a wall; `tilt_m`: how far the depth bends from one end to the other.

    `bulge_m`: how far it bulges, which no pose explains. `distances_m`: of the box in each frame (0.5).
    """
    frames, poses = [], []
    for i in range(count):
        z = 0.5 if distances_m is None else distances_m[i]
        T = geometry.pose([0.5 + 0.006 * i, -0.6, 0.2 + 0.004 * i], [0.01 + 0.0008 * i, 0.02, z])
        random = np.random.default_rng(i)
        d = BOX.raycast(CAMERA, T)[0]
        read = bent(d, T, random, tilt_m, bulge_m)
        noisy = np.where((d > 0)[..., None], OBJECT, AROUND) + random.normal(0, 8, (*d.shape, 3))
        depth = np.where(d > 0, read, 1.2).astype(np.float32)
        frames.append(st.Frame(depth, np.clip(noisy, 0, 255).astype(np.uint8), timestamp=i / 30))
        poses.append(T)
    return frames, poses


def follow(frames, poses, without=(), **options):
    tracker = st.Tracker(VOLUME, CAMERA, **{"mode": "rgbd", "threads": 1, **options})
    results = []
    for i, given in enumerate(frames):
        frame = st.Frame(None, given.color, timestamp=given.timestamp) if i in without else given
        results.append(tracker.start(frame, poses=[poses[0]]) if i == 0 else tracker.track(frame))
    errors = np.array([st.metrics.pose_error(r.pose, T) for r, T in zip(results, poses, strict=True)])
    return errors * [1e3, 180 / np.pi], results, tracker


def test_depth_that_bends_turns_the_object_less_with_the_outline():
    frames, poses = scene(40, tilt_m=0.003)
    off, *_ = follow(frames, poses, outline=False)
    on, results, _ = follow(frames, poses, outline_from_m=0, outline_weight=3.0)
    assert off[10:, 1].mean() > 1
    assert on[10:, 1].mean() < 0.7 * off[10:, 1].mean()
    assert all(r.status[0] in (st.Status.OK, st.Status.WEAK) for r in results)


def test_depth_that_is_seen_to_err_does_not_turn_the_object():
    frames, poses = scene(40, tilt_m=0.006, bulge_m=0.004)
    off, *_ = follow(frames, poses, outline=False)
    on, results, _ = follow(frames, poses)
    assert off[10:, 1].mean() > 3
    assert on[10:, 1].mean() < 0.6
    assert all(r.status[0] in (st.Status.OK, st.Status.WEAK) for r in results)
    never, *_ = follow(frames, poses, outline_from_m=1)
    assert never[10:, 1].mean() > 3


def test_without_a_bias_nothing_is_lost():
    frames, poses = scene(20)
    off, *_ = follow(frames, poses, outline=False)
    on, *_ = follow(frames, poses, outline_from_m=0)
    assert on.mean(axis=0) == pytest.approx(off.mean(axis=0), rel=0.25)
    default, *_ = follow(frames, poses)
    assert default.mean(axis=0) == pytest.approx(off.mean(axis=0), rel=0.05)


def scene_of_two(count, colors, tilt_m, bulge_m):
    """Two boxes side by side, 2 mm apart, that turn together; each bends the depth."""
    frames, poses = [], []
    beside = geometry.pose([0, 0, 0], [0, np.ptp(BOX.vertices[:, 1]) + 0.002, 0])
    for i in range(count):
        first = geometry.pose([0.5 + 0.006 * i, -0.6, 0.2 + 0.004 * i], [-0.03 + 0.0008 * i, 0.02, 0.6])
        random = np.random.default_rng(i)
        depth, color = np.full(CAMERA.shape, 1.2), np.tile(AROUND.astype(float), (*CAMERA.shape, 1))
        for T, own in zip((first, first @ beside), colors, strict=True):
            d = BOX.raycast(CAMERA, T)[0]
            seen = (d > 0) & (d < depth)
            depth[seen], color[seen] = bent(d, T, random, tilt_m, bulge_m)[seen], own
        noisy = np.clip(color + random.normal(0, 8, color.shape), 0, 255).astype(np.uint8)
        frames.append(st.Frame(depth.astype(np.float32), noisy, timestamp=i / 30))
        poses.append([first, first @ beside])
    return frames, poses


@pytest.mark.parametrize("other", [OBJECT, np.array([60, 170, 60], np.uint8)], ids=["alike", "unlike"])
def test_two_that_touch_are_held_by_their_outlines_too(other):
    frames, poses = scene_of_two(40, [OBJECT, other], tilt_m=0.006, bulge_m=0.004)
    degrees = {}
    for outline in (False, True):
        tracker = st.Tracker([VOLUME] * 2, CAMERA, mode="rgbd", threads=1, outline=outline)
        results = [tracker.start(frames[0], poses=poses[0]), *(tracker.track(f) for f in frames[1:])]
        assert all(s is not st.Status.LOST for r in results for s in r.status)
        errors = [
            [st.metrics.pose_error(T, truth)[1] for T, truth in zip(r.poses, both, strict=True)]
            for r, both in zip(results, poses, strict=True)
        ]
        degrees[outline] = np.degrees(errors)[10:].mean(axis=0)
    assert (degrees[False] > 2).all()
    assert (degrees[True] < 0.5 * degrees[False]).all()


def halved(frame, T):
    """Each half of the object in the colour that is behind the other half: all in all, no colour tells them apart."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    x, y = (u - CAMERA.cx) / CAMERA.fx * T[2, 3], (v - CAMERA.cy) / CAMERA.fy * T[2, 3]
    left = (np.stack([x, y, np.full_like(x, T[2, 3])], -1) - T[:3, 3]) @ T[:3, 0] < 0
    inside = BOX.raycast(CAMERA, T)[0] > 0
    color = np.where((inside ^ left)[..., None], OBJECT, AROUND).astype(np.uint8)
    return st.Frame(None, color, timestamp=frame.timestamp)


def test_colours_are_learnt_place_by_place():
    frames, poses = scene(30)
    halves = [halved(frame, T) for frame, T in zip(frames, poses, strict=True)]
    local, results, _ = follow(halves, poses, mode="rgb")
    assert local[:, 0].max() < 2
    assert all(r.status[0] is st.Status.WEAK for r in results)
    _, results, _ = follow(halves, poses, mode="rgb", outline_local=False)
    assert all(r.status[0] is st.Status.LOST for r in results)


def test_every_tenth_frame_without_depth_is_followed():
    frames, poses = scene(41)
    without = range(9, 41, 10)
    errors, results, _ = follow(frames, poses, without)
    assert errors[:, 0].max() < 3
    assert errors[:, 1].max() < 2
    for i in without:
        assert results[i].status[0] is st.Status.WEAK
        assert "tracked by the outline" in results[i].reason[0]
        C = results[i].covariances[0]
        assert C[2, 2] > 4 * max(C[0, 0], C[1, 1])  # along the viewing direction
    assert results[10].status[0] is st.Status.OK
    blank = [st.Frame(np.zeros_like(f.depth), f.color, timestamp=f.timestamp) for f in frames[9:10]]
    again, results, _ = follow([*frames[:9], *blank], poses[:10])
    assert again[9] == pytest.approx(errors[9])
    _, results, _ = follow(frames[:11], poses[:11], [9], outline=False)
    assert results[9].status[0] is st.Status.BAD_FRAME


def test_thirty_frames_in_a_row_without_depth_are_followed():
    frames, poses = scene(41)
    errors, results, _ = follow(frames, poses, range(5, 35))
    assert errors[:, 0].max() < 3
    assert errors[:, 1].max() < 2
    assert results[-1].status[0] is st.Status.OK


def test_colour_alone_follows():
    frames, poses = scene(40)
    errors, results, tracker = follow(frames, poses, mode="rgb")
    assert errors[:, 0].max() < 5
    assert errors[:, 1].max() < 3
    assert all(r.status[0] is st.Status.WEAK for r in results)
    assert tracker.mode_used == ["rgb"]
    bare = [st.Frame(None, f.color, timestamp=f.timestamp) for f in frames]
    same, *_ = follow(bare, poses, mode="rgb")
    assert np.array_equal(same, errors)  # depth is not read


def test_an_error_that_the_whole_outline_shares_does_not_let_the_distance_swing():
    """It hardly changes between frames: no reason to trust the expected motion more than a frame."""
    frames, poses = scene(60, distances_m=0.75 + 0.04 * np.sin(np.arange(60) / 8))
    errors, results, _ = follow(frames, poses, range(1, 60))
    assert errors[:, 0].mean() < 3
    assert errors[:, 0].max() < 10
    stated = [np.sqrt(r.covariances[0][2, 2]) for r in results[1:]]
    assert min(stated) > 0.008  # of the error that all lines may share


def test_colour_alone_is_lost_where_nothing_tells_the_object_apart():
    frames, poses = scene(2)
    tracker = st.Tracker(VOLUME, CAMERA, mode="rgb")
    tracker.start(frames[0], poses=poses[:1])
    grey = st.Frame(None, np.full((*CAMERA.shape, 3), 90, np.uint8))
    lost = tracker.track(grey)
    assert lost.status[0] is st.Status.LOST
    assert "too little of the outline" in lost.reason[0]
    assert tracker.track(frames[1]).status[0] is st.Status.WEAK


@pytest.mark.parametrize("delay_s", [0.0, 0.015, -0.03])
def test_colour_of_another_moment_is_measured(delay_s):
    def pose_at(t):
        turn = [0.5 + 0.5 * np.sin(2 * t), -0.6, 0.2 + 0.3 * np.sin(3 * t)]
        return geometry.pose(turn, [0.05 * np.sin(2.2 * t), 0.02 + 0.03 * np.sin(3.1 * t), 0.5])

    tracker = st.Tracker(VOLUME, CAMERA, mode="rgbd", threads=1)
    random = np.random.default_rng(0)
    for i in range(80):
        t = i / 30
        d, shown = (BOX.raycast(CAMERA, pose_at(at))[0] for at in (t, t + delay_s))
        depth = np.where(d > 0, d + random.normal(0, 0.001, d.shape), 1.2).astype(np.float32)
        noisy = np.where((shown > 0)[..., None], OBJECT, AROUND) + random.normal(0, 8, (*d.shape, 3))
        frame = st.Frame(depth, np.clip(noisy, 0, 255).astype(np.uint8), timestamp=t)
        if i:
            tracker.track(frame)
        else:
            assert tracker.color_delay is None
            tracker.start(frame, poses=[pose_at(0)])
    found = tracker.color_delay
    assert found.sd_s < 0.005
    assert found.delay_s == pytest.approx(delay_s, abs=min(3 * found.sd_s, 0.004))
    assert found.significant is (delay_s != 0)
    assert ("earlier" in str(found)) == (found.delay_s < 0)
