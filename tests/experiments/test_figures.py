# SPDX-License-Identifier: MIT
"""The scenes of the figures, and what is counted on them: each measure on a case whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

import sdftrack as st
from experiments.calibration.convergence import within_from
from experiments.common.pose_sets import half_turns
from experiments.common.sweeps import TRUTH, values_of
from experiments.reconstruction.reach import aligned_error
from experiments.reconstruction.seen_part import sampled
from sdftrack import geometry


def test_turns_of_a_box_leave_it_where_it_is():
    centre, half = np.array([0.01, -0.02, 0.03]), np.array([0.05, 0.03, 0.05])
    corners = centre + half * np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    turns = half_turns(centre, quarter_axis=1)
    assert len({np.round(S, 6).tobytes() for S in turns}) == 8
    for S in turns:
        moved = corners @ S[:3, :3].T + S[:3, 3]
        assert sorted(map(tuple, np.round(moved, 6))) == sorted(map(tuple, np.round(corners, 6)))


def test_what_comes_late_into_the_band_or_leaves_it_again_is_not_called_within():
    truth = values_of(TRUTH)
    running = np.tile(truth, (10, 1))
    assert within_from(running, 10) == 1
    running[3, 2] += 2.1  # cx: 2 px are allowed
    assert within_from(running, 10) == 5
    assert within_from(running, 13) == 8  # three frames are not in the mean
    running[9, 0] += 5.8  # fx: 1 % is 5.75 px
    assert within_from(running, 10) is None


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
