# SPDX-License-Identifier: MIT
"""The scenes of the figures, and what is counted on them: each measure on a case whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

import sdftrack as st
from experiments.calibration.convergence import within_from
from experiments.common.pose_sets import half_turns, off_pose
from experiments.common.sweeps import TRUTH, box_mesh, swept, values_of
from experiments.common.truth import default_camera, motion, noisy, render_truth
from experiments.reconstruction.carried_camera import aligned, around, carried
from experiments.reconstruction.known_and_unknown import share_seen
from experiments.reconstruction.parts import evidence
from experiments.reconstruction.reach import aligned_error
from experiments.reconstruction.seen_part import sampled
from sdftrack import geometry
from sdftrack.synth.duck import duck_mesh


@pytest.fixture(scope="module")
def duck():
    return duck_mesh()


@pytest.fixture(scope="module")
def box():
    return st.SDF.box((0.10, 0.07, 0.05)).to_mesh()


# --- scenes


def test_another_draw_of_the_noise_lies_on_the_same_path():
    small = st.Camera(120, 120, 79.5, 59.5, 160, 120)
    first, same, other = (swept(box_mesh(), 3, 0.001, 2, draw, small) for draw in (0, 0, 1))
    np.testing.assert_array_equal(first[1].depth, same[1].depth)
    np.testing.assert_array_equal(first.ground_truth[1][0], other.ground_truth[1][0])
    seen = first[1].depth > 0
    difference = (first[1].depth - other[1].depth)[seen]
    assert difference.std() == pytest.approx(np.sqrt(2) * 0.001, rel=0.1)  # of some 1,000 readings: 2 %


def test_truth_is_the_same_from_the_cache(tmp_path, box):
    camera = st.Camera(200, 200, 79.5, 59.5, 160, 120)
    poses = motion(3, 0.005, 0.02, seed=0)
    fresh = render_truth(box, poses, camera, cache=tmp_path)
    again = render_truth(box, poses, camera, cache=tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    np.testing.assert_array_equal(fresh.depth(2), again.depth(2))
    np.testing.assert_array_equal(fresh.depth(2), box.raycast(camera, poses[2])[0])
    np.testing.assert_array_equal(fresh.bound_m, again.bound_m)


def test_an_object_out_of_view_is_named(box):
    away = np.eye(4)
    away[2, 3] = -1
    with pytest.raises(ValueError, match=r"poses\[0\]: expected the object in view"):
        render_truth(box, away[None], default_camera())


def test_noise_has_the_asked_spread_and_leaves_holes_alone():
    depth = np.full((100, 100), 0.8, np.float32)
    depth[:10] = 0
    out = noisy(depth, 0.002, np.random.default_rng(0))
    assert (out[:10] == 0).all()
    assert out[10:].std() == pytest.approx(0.002, rel=0.05)
    assert abs(out[10:].mean() - 0.8) < 1e-4


def test_random_starts_are_off_by_what_was_asked():
    T = motion(1, 0.0, 0.0, seed=5)[0]
    metres, radians = st.metrics.pose_error(off_pose(T, 0.01, 0.1, np.random.default_rng(0)), T)
    assert (metres, radians) == pytest.approx((0.01, 0.1))


def test_turns_of_a_box_leave_it_where_it_is():
    centre, half = np.array([0.01, -0.02, 0.03]), np.array([0.05, 0.03, 0.05])
    corners = centre + half * np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    turns = half_turns(centre, quarter_axis=1)
    assert len({np.round(S, 6).tobytes() for S in turns}) == 8
    for S in turns:
        moved = corners @ S[:3, :3].T + S[:3, 3]
        assert sorted(map(tuple, np.round(moved, 6))) == sorted(map(tuple, np.round(corners, 6)))


def test_the_path_of_figure_4_13_shows_the_whole_surface(duck):
    poses = motion(300, 0.005, np.deg2rad(1.5), 0, duck.bounds.mean(axis=0))
    assert share_seen(duck, poses[::10]) > 0.98
    assert 0.4 < share_seen(duck, poses[:8]) < 0.8  # 10 degrees of a turn


def test_nothing_about_the_object_touches_it(duck):
    rest = around(duck).vertices
    beside = rest[rest[:, 2] > duck.bounds[0, 2] + 1e-6]
    assert np.linalg.norm(beside[:, None, :2] - duck.vertices[None, ::20, :2], axis=2).min() > 0.02


# --- measures


def test_what_comes_late_into_the_band_or_leaves_it_again_is_not_called_within():
    truth = values_of(TRUTH)
    running = np.tile(truth, (10, 1))
    assert within_from(running, 10) == 1
    running[3, 2] += 2.1  # cx: 2 px are allowed
    assert within_from(running, 10) == 5
    assert within_from(running, 13) == 8  # three frames are not in the mean
    running[9, 0] += 5.8  # fx: 1 % is 5.75 px
    assert within_from(running, 10) is None


def test_paths_are_compared_after_their_centres_are_laid_upon_each_other(duck):
    path = geometry.inverse(carried(duck, 40))
    moved = geometry.pose([0.2, -0.4, 1.0], [0.3, 0.1, -0.2]) @ path
    np.testing.assert_allclose(aligned(moved, path), path, atol=1e-9)


def test_alignment_finds_the_motion_between_two_like_shapes():
    shape = st.SDF.box((0.10, 0.07, 0.05), voxels=80)
    points, _ = sampled(shape.to_mesh(), 4000)
    moved = geometry.pose([0.02, -0.01, 0.03], [0.002, 0.001, -0.002])
    error, T = aligned_error(shape, geometry.transform_points(geometry.inverse(moved), points), np.eye(4))
    assert error < 1e-4
    np.testing.assert_allclose(T, moved, atol=2e-4)
    larger = st.SDF.sphere(0.052, voxels=80)
    ball, _ = sampled(st.SDF.sphere(0.05, voxels=80).to_mesh(), 4000)
    assert aligned_error(larger, ball, np.eye(4))[0] == pytest.approx(0.002, abs=1e-4)


def test_both_forms_of_the_evidence_agree_far_from_the_reading():
    d = np.array([-20.0, -5.0, 5.0, 20.0])
    np.testing.assert_allclose(evidence(d, 8.0, 1.0), evidence(d, 8.0, None), atol=1e-6)
    assert evidence(np.array([-1e-3]), 8.0, None)[0] < 0.001  # the printed one is sure at once
    assert evidence(np.array([-1e-3]), 8.0, 1.0)[0] == pytest.approx(0.5, abs=1e-3)
