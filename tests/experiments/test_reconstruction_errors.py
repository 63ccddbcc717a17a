# SPDX-License-Identifier: MIT
"""How reconstructions are judged: the measures on shapes whose distances are known, and a small run."""

import numpy as np
import pytest

import sdftrack as st
from experiments.reconstruction.rebuilt import relative_errors
from experiments.reconstruction.seen_part import Truth, compare
from sdftrack import geometry

RADIUS_M = 0.05
CAMERA = st.Camera(300.0, 300.0, 159.5, 119.5, 320, 240)
FIELD_ATOL_M = 3e-5  # two volumes of 100 voxels stand for the surfaces


def ball(radius=RADIUS_M, middle=(0, 0, 0)):
    return st.SDF.sphere(radius, voxels=100).to_mesh().transformed(geometry.pose(t_m=middle))


@pytest.fixture(scope="module")
def truth():
    mesh = ball()
    turns = np.arange(0, 2 * np.pi, np.pi / 6).repeat(5)  # about y, half a metre in front of the camera
    views = np.array([geometry.pose([0, w, 0], [0, 0, 0.5]) for w in turns])
    return Truth.of(mesh, st.SDF.sphere(RADIUS_M, voxels=100), CAMERA, views, count=20_000)


def test_the_same_shape_has_no_distance(truth):
    got = compare(ball(), truth, voxels=100)
    assert got.chamfer_m < FIELD_ATOL_M
    assert got.complete == 1.0
    assert 0.85 < got.seen_share < 1.0  # not the poles


def test_a_larger_ball_is_as_far_as_it_is_larger(truth):
    got = compare(ball(RADIUS_M + 0.001), truth, voxels=100)
    assert got.to_truth_m == pytest.approx(0.001, abs=FIELD_ATOL_M)
    assert got.to_rebuilt_m == pytest.approx(0.001, abs=FIELD_ATOL_M)
    assert got.offset_m == pytest.approx(0.001, abs=FIELD_ATOL_M)
    assert compare(ball(RADIUS_M - 0.004), truth, voxels=100).complete == 0.0


def test_errors_are_relative_to_the_first_frame():
    rng = np.random.default_rng(0)
    truth = np.array([geometry.pose(rng.normal(size=3), [0, 0, 0.5]) for _ in range(3)])
    other = geometry.pose([0.3, -0.2, 0.5], [0.02, 0.01, -0.03])  # another object frame
    found = truth @ other
    same = relative_errors(found, truth, np.array([0.1, 0, 0]))
    assert max(same.metres.max(), same.radians.max()) < 1e-9
    found[2] = geometry.pose(t_m=[0.001, 0, 0]) @ found[2]
    moved = relative_errors(found, truth, np.array([0.1, 0, 0]))
    np.testing.assert_allclose(moved.metres, [0, 0, 0.001], atol=1e-9)
    # Turned about the middle of the object: that stays where it is.
    middle = np.array([0.1, 0, 0])
    about = geometry.pose(t_m=middle) @ geometry.pose([0, 0, 0.01]) @ geometry.pose(t_m=-middle)
    turned = relative_errors(np.array([truth[0], truth[1] @ about]), truth[:2], middle)
    np.testing.assert_allclose(turned.metres, 0, atol=1e-9)
    np.testing.assert_allclose(turned.radians, [0, 0.01], atol=1e-9)
