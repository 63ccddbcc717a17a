# SPDX-License-Identifier: MIT
"""Scenes of several look-alikes, and what is counted on them, in small."""

import numpy as np
import pytest

import sdftrack as st
from experiments.several.identity import Tracked, swapped, swaps
from experiments.synth.contact import Solid, deepest, gap
from sdftrack import geometry

RADIUS_M = 0.05
BALL_ATOL_M = 4e-4  # 3000 points on the ball lie 3 mm apart, the volume's voxels 2 mm


@pytest.fixture(scope="module")
def ball():
    sdf = st.SDF.sphere(RADIUS_M)
    return Solid.of(sdf.to_mesh(), sdf)


def at(*place):
    return geometry.pose(t_m=place)


@pytest.mark.parametrize("overlap_m", [0.004, 0.0, -0.003])
def test_the_gap_of_two_balls_is_that_of_their_centres(ball, overlap_m):
    a, b = at(0, 0, 0.8), at(0.6 * (2 * RADIUS_M - overlap_m), 0, 0.8 + 0.8 * (2 * RADIUS_M - overlap_m))
    assert gap(ball, a, b) == pytest.approx(-overlap_m, abs=BALL_ATOL_M)
    found = deepest(ball, np.array([[a, b], [a, at(0.5, 0, 0.8)]]))
    np.testing.assert_allclose(found, [max(0.0, overlap_m), 0], atol=BALL_ATOL_M)
    gone = np.array([[True, False], [True, True]])  # a lost object sinks into nothing
    np.testing.assert_array_equal(deepest(ball, np.array([[a, b], [a, at(0.5, 0, 0.8)]]), gone), [0, 0])


# --- identity ------------------------------------------------------------------------------------------------
def _said(poses, status=None, confidence=None):
    shape = poses.shape[:2]
    return Tracked(
        poses, np.full(shape, "ok", dtype="<U9") if status is None else status,
        np.ones(shape) if confidence is None else confidence, np.full(shape[0], 0.001),
    )  # fmt: skip


def test_a_swap_on_purpose_is_counted_and_nothing_else(ball):
    truth = np.tile(np.eye(4), (20, 3, 1, 1))
    truth[:, :, 0, 3] = [-0.1, 0.0, 0.1]
    truth[:, :, 2, 3] = 0.8
    points = ball.points[::30]
    poses = truth.copy()
    poses[:, :, :3, 3] += 0.01  # off, but nearest to its own
    poses[3, 0, 0, 3] -= 0.5  # far away from all
    assert not swapped(points, poses, truth).any()
    poses[5:9, [0, 1]] = poses[5:9, [1, 0]]  # two change places for four frames
    poses[15:, 2] = truth[15:, 1]  # and one collapses onto its neighbour
    wrong = swapped(points, poses, truth)
    said = _said(poses)
    assert swaps(wrong, said.reported) == 3
    status = said.status.copy()
    status[6, 0] = "lost"  # the same event goes on
    assert swaps(wrong, _said(poses, status).reported) == 3
    status[:, 2], confidence = "weak", said.confidence.copy()
    confidence[:, 2] = 0.2  # claims nothing
    assert swaps(wrong, _said(poses, status, confidence).reported) == 2
