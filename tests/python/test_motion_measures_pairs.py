# SPDX-License-Identifier: MIT
"""Measures that compare two objects, left with right; and times beyond a threshold."""

from itertools import groupby

import numpy as np
import pytest
from motion_cases import noisy, reaches

import sdftrack as st
from sdftrack import motion
from sdftrack.motion.measures.targets import beginnings, settled

RADIUS_M = 0.03


def slow_settled(holds, count):
    """One row: breaks shorter than `count` between stretches are filled, then stretches shorter than it are dropped."""
    for value in (False, True):
        runs = [(v, len(list(g))) for v, g in groupby(holds)]
        holds = []
        for k, (v, length) in enumerate(runs):
            inner = 0 < k < len(runs) - 1
            holds += [v != (v == value and inner and length < count)] * length
    return np.array(holds)


@pytest.fixture(scope="module")
def ball():
    sdf = st.SDF.sphere(RADIUS_M, voxels=60, padding=0.02)
    return sdf, sdf.surface_samples(800)[0].astype(np.float64)


@pytest.mark.parametrize("n", [2, 3, 30, 200])
@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_stretches_are_those_of_the_slow_one(n, count):
    holds = np.random.default_rng(n + count).random((40, n)).repeat(3, axis=1)[:, :n] < 0.5
    found = settled(holds, 1.0, count)
    for row, one in zip(holds, found, strict=True):
        assert one.tolist() == slow_settled(row.tolist(), count).tolist()
    starts = [sum(1 for v, _ in groupby(row) if v) for row in found.tolist()]
    assert beginnings(found).sum(axis=1).tolist() == starts


def carried(away_m, seed, start_s=0.0):
    """An object that is carried along x and back, twice."""
    t = np.arange(240) / 30
    x = reaches(t, [1.0, 4.5], (away_m, 0, 0))
    return motion.analyze(noisy(t + start_s, x, seed=seed, sd_m=2e-4, sd_rad=2e-3))


class TestTwoTrajectories:
    def test_a_ball_that_is_carried_to_another_one_touches_it_twice(self, ball):
        sdf, points = ball
        moving = carried(0.2, seed=0)
        resting = np.tile([0.2 + 2 * RADIUS_M, 0, 0.8], (240, 1))
        second = motion.analyze(noisy(moving.trajectory.times_s, resting, seed=1, sd_m=2e-4, sd_rad=2e-3))
        found = motion.contact(moving, second, sdf, points)
        far = motion.contact(
            moving, motion.analyze(noisy(moving.trajectory.times_s, resting + 0.1, seed=1)), sdf, points
        )
        assert far["contacts"].value == far["contact_time"].value == 0
        assert found["surface_distance"].value == pytest.approx(0.0, abs=2e-3)
        assert found["contacts"].value == 2
        # Held for 0.7 s each, and within 3 mm for the last and first parts of the movements.
        assert 2 * 0.7 < found["contact_time"].value < 2 * 1.3
        assert found["contact_time"].low <= found["contact_time"].value <= found["contact_time"].high
        with pytest.raises(ValueError, match="expected a trajectory of the same time"):
            motion.contact(moving, carried(0.2, 0, start_s=100.0), sdf, points)

    def test_symmetry_of_equal_and_of_unequal_movements(self):
        left, same, short = (carried(away_m, seed) for seed, away_m in enumerate((0.2, -0.2, 0.1), 1))
        equal, unequal = motion.symmetry(left, same)["reach"], motion.symmetry(left, short)["reach"]
        assert equal.low < 0 < equal.high
        assert unequal.low < 200 * 0.1 / 0.3 < unequal.high
        assert motion.symmetry(short, left)["reach"].value == pytest.approx(-unequal.value)
