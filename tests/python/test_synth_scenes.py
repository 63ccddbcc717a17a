# SPDX-License-Identifier: MIT
"""Hands in contact, boards, absences, touching clutter, and the cache of noise-free pictures."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack.synth import Cover, Grip, leave_and_return
from sdftrack.synth.bodies import Body, Stage
from sdftrack.synth.grip import Capsules, _Held, cast
from sdftrack.synth.surroundings import Tabletop, box_mesh

CAMERA = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
TINY = st.Camera(65.625, 65.625, 39.5, 29.5, 80, 60)
HALF = np.array([0.05, 0.07, 0.09])
BOX = box_mesh(2 * HALF)
SHARE_TOLERANCE = 0.02  # a capsule more or less of one finger: about 40 of 4,000 pixels
CONTACT_M = 1e-3  # a finger that an edge meets from the side, between surface points 2.5 mm apart: 0.7 mm
CAST_TOLERANCE_M = 2e-6  # float32 depth at 0.8 m, and a bisection that ends there


def _box_distance(p):
    q = np.abs(p) - HALF
    return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0)


def _stage(poses, seed=0):
    return Stage(Body(BOX, 0, seed), poses, CAMERA, seed, 30.0)


def _poses(n, seed=0):
    return st.synth.random_walk()(n, np.random.default_rng(seed), np.zeros(3))


def test_rays_meet_capsules_where_their_distance_is_the_radius():
    rng = np.random.default_rng(0)
    a = np.array([0.0, 0.0, 0.6]) + rng.uniform(-0.1, 0.1, (6, 3))
    some = Capsules(a, a + rng.uniform(-0.08, 0.08, (6, 3)), rng.uniform(0.005, 0.03, 6))
    hits = cast(some, TINY)
    p = hits.depth[:, None] * np.column_stack(
        [TINY.rays.reshape(-1, 2)[hits.pixel], np.ones(len(hits.pixel))]
    )

    def distance(p, k):
        axis = some.b[k] - some.a[k]
        h = np.clip(((p - some.a[k]) * axis).sum(-1) / (axis**2).sum(-1), 0, 1)
        return np.linalg.norm(p - some.a[k] - h[:, None] * axis, axis=1) - some.radius[k]

    assert np.abs(distance(p, hits.capsule)).max() < CAST_TOLERANCE_M
    assert (distance(0.999 * p, hits.capsule) > 0).all()  # the first meeting, from outside
    assert len(set(hits.capsule)) == 6
    # And no ray is left out: of all rays, those that get inside are those with a hit.
    rays = np.column_stack([TINY.rays.reshape(-1, 2), np.ones(TINY.width * TINY.height)]).astype(float)
    for k in range(6):
        lowest = np.full(len(rays), np.inf)
        for z in np.arange(0.4, 0.8, 0.002):
            lowest = np.minimum(lowest, distance(z * rays, np.full(len(rays), k)))
        hit = np.zeros(len(rays), bool)
        hit[hits.pixel[hits.capsule == k]] = True
        assert hit[lowest < 0].all()
        assert not hit[lowest > 3e-4].any()  # 2 mm apart near the rim of a ball of 5 mm: 0.1 mm too high


@pytest.mark.parametrize(("share", "color"), [(0.2, "skin"), (0.6, "similar")])
def test_a_grip_hides_the_wanted_share(share, color):
    bare = st.synth.sequence(BOX, 40, camera=CAMERA, seed=3)
    seq = st.synth.sequence(BOX, 40, occluder=Grip(share, color), camera=CAMERA, seed=3)
    for i in (0, 24, 39):
        before, after = bare.masks(i)[0], seq.masks(i)[0]
        assert not (after & ~before).any()
        assert 1 - after.sum() / before.sum() == pytest.approx(share, abs=SHARE_TOLERANCE)
        hidden = before & ~after
        assert (seq[i].depth[hidden] < bare[i].depth[hidden]).all()
        np.testing.assert_array_equal(seq.ground_truth[i][0], bare.ground_truth[i][0])


def test_fingers_touch_the_object_and_stay_outside():
    held = _Held(Grip(0.6), _stage(_poses(60)))
    for i in (0, 17, 25, 44):
        hand = held.hand(i)
        fingers = hand.reach > -np.inf
        ends = hand.capsules.a[fingers]
        gap = _box_distance(ends) - 0.009
        assert gap.min() > -CONTACT_M
        for j in np.unique(hand.finger[fingers]):
            own = hand.finger[fingers] == j
            if own.sum() > 8:  # a finger that only meets a corner of the box has hardly a side to touch
                assert np.abs(gap[own]).min() < CONTACT_M
                assert np.mean(gap[own] < 0.003) > 0.3  # it lies along a side, not on one point


def test_a_cover_hides_all_of_the_object_in_its_frames_alone():
    path = leave_and_return(3, 4, out_m=0)
    bare = st.synth.sequence(BOX, 9, path, camera=CAMERA, clutter="wall", seed=1)
    seq = st.synth.sequence(BOX, 9, path, occluder=Cover(3, 4), camera=CAMERA, clutter="wall", seed=1)
    for i in range(9):
        if 3 <= i < 7:
            assert not seq.masks(i)[0].any()
            assert bare.masks(i)[0].any()
            near = seq[i].depth[bare.masks(i)[0]]
            assert (near < bare[i].depth[bare.masks(i)[0]] - 0.04).all()
        else:
            assert seq[i] == bare[i]


@pytest.mark.parametrize("out_m", [3.0, 0.0])
def test_an_object_leaves_and_comes_back_elsewhere(out_m):
    for seed in range(5):
        seq = st.synth.sequence(BOX, 40, leave_and_return(10, 15, out_m), camera=CAMERA, seed=seed)
        T = np.array([seq.ground_truth[i][0] for i in range(40)])
        metres, radians = st.metrics.pose_error(T[25], T[9])
        assert metres >= 0.08
        assert radians > 0.1
        seen = [bool(seq.masks(i)[0].any()) for i in range(40)]
        assert seen == ([True] * 10 + [False] * 15 + [True] * 15 if out_m else [True] * 40)
        steps = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
        np.testing.assert_allclose(np.delete(steps, range(9, 25)), 0.005, atol=1e-9)
    short = st.synth.sequence(BOX, 5, leave_and_return(10, 15), camera=CAMERA)
    assert short.masks(4)[0].any()


def test_things_on_the_table_touch_the_object_and_do_not_enter_it():
    for seed in range(4):
        body, poses = Body(BOX, 0, seed), _poses(3, seed)
        table = Tabletop(body, poses, np.random.default_rng(seed))
        assert len(table.things) >= 4
        p = body.points
        board = table.things[0].vertices
        up = -(poses[0][:3, :3].T @ [0, np.cos(np.radians(40)), np.sin(np.radians(40))])
        # up is a mean over the path
        np.testing.assert_allclose((p @ up).min(), (board @ up).max(), atol=0.02)
        for thing in table.things[1:]:
            gap = _box_distance(Body(thing, 0, 0).points)
            assert np.abs(gap.min()) < 2e-3  # it stops at a point; those stand 2.5 mm apart
            assert np.mean(gap > 0.01) > 0.5


def test_touching_clutter_moves_with_the_object():
    seq = st.synth.sequence(BOX, 4, camera=CAMERA, clutter="touching", seed=2)
    table = seq._frames._table
    for i in (0, 3):
        T = seq.ground_truth[i][0]
        depth = np.full(CAMERA.shape, np.inf, np.float32)
        for mesh in [BOX, *table.things]:
            d = mesh.raycast(CAMERA, T)[0]
            depth = np.where(d > 0, np.minimum(depth, d), depth)
        near = np.isfinite(depth)
        np.testing.assert_array_equal(seq[i].depth[near], depth[near])
        seen = BOX.raycast(CAMERA, T)[0]
        np.testing.assert_array_equal(seq.masks(i)[0], (seen > 0) & (seen == depth))


def test_the_same_pictures_come_from_the_cache(tmp_path):
    def make(**changes):
        known = {"noise": "kinect", "occluder": Grip(0.4), "camera": TINY, "clutter": "objects", "seed": 4}
        return st.synth.sequence(BOX, 3, **{**known, **changes})

    plain = make()
    first, again = make(cache=tmp_path), make(cache=tmp_path)
    for i in (2, 0):
        assert first[i] == plain[i]
        assert again[i] == plain[i]
        np.testing.assert_array_equal(again.masks(i)[0], plain.masks(i)[0])
    (folder,) = tmp_path.iterdir()
    assert sorted(p.name for p in folder.iterdir()) == ["000000.npz", "000002.npz"]
    make(cache=tmp_path, noise=0.001)[0]  # noise is no part of the picture
    assert len(list(tmp_path.iterdir())) == 1
    for change in ({"occluder": Grip(0.5)}, {"seed": 5}, {"color": False}, {"clutter": "wall"}):
        make(cache=tmp_path, **change)[0]
    assert len(list(tmp_path.iterdir())) == 5
