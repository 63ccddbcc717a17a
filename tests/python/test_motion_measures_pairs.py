# SPDX-License-Identifier: MIT
"""Measures that compare: surfaces of two objects, left with right; and times beyond a tilt or a threshold."""

from itertools import groupby

import numpy as np
import pytest
from motion_cases import noisy, reaches
from scipy.spatial.transform import Rotation

import sdftrack as st
from sdftrack import motion
from sdftrack.motion.measures.targets import beginnings, settled

RATE_HZ = 100.0
RADIUS_M = 0.03


def placed(t, x, turn=None, observed=None):
    """MotionSamples of positions (S, n, 3) and rotation vectors (S, n, 3); what has no meaning here is zero."""
    x = np.asarray(x, np.float64)
    turn = np.zeros_like(x) if turn is None else np.asarray(turn, np.float64)
    R = Rotation.from_rotvec(turn.reshape(-1, 3)).as_matrix().reshape(*x.shape, 3)
    seen = np.ones(len(t), bool) if observed is None else observed
    return motion.MotionSamples(t, x, 0 * x, 0 * x, 0 * x, R, 0 * x, seen)


def times(n=201):
    return np.arange(n) / RATE_HZ


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


class TestSurfaceDistances:
    # Half a voxel of 2 mm and the distance of the points from each other, 4 mm on a ball of 30 mm: (4e-3)^2 / 2 / R.
    TOLERANCE_M = 1e-3

    def test_two_spheres_are_apart_by_their_centres_less_their_radii(self, ball):
        t = times(101)
        x = np.zeros((2, len(t), 3))
        x[0, :, 0] = 0.055 + 0.015 * np.cos(2 * np.pi * t)  # 40 to 70 mm: they overlap by 20 mm at most
        x[1, :, 1] = 0.065 - 0.01 * t
        rng = np.random.default_rng(1)
        at = rng.normal(size=(2, 1, 3))  # anywhere, turned anyhow
        a = placed(t, np.tile(at, (1, len(t), 1)), rng.normal(size=x.shape))
        b = placed(t, at + x, rng.normal(size=x.shape))
        found = motion.surface_distances(a, b, *ball)
        expected = np.linalg.norm(x, axis=-1) - 2 * RADIUS_M
        assert found.shape == (2, len(t))
        outside = expected > -0.005
        assert np.abs(found - expected)[outside].max() < self.TOLERANCE_M

    def test_the_turn_of_both_objects_counts(self):
        box = st.SDF.box([0.04, 0.04, 0.2], voxels=80, padding=0.03)
        points = box.surface_samples(2000)[0]
        t = times(3)
        x = np.tile([0.15, 0.0, 0.0], (1, 3, 1))
        upright, lying = np.zeros((1, 3, 3)), np.tile([0.0, np.pi / 2, 0.0], (1, 3, 1))
        for turn_a, turn_b, expected in (
            (upright, upright, 0.15 - 0.04),
            (lying, upright, 0.15 - 0.1 - 0.02),
            (upright, lying, 0.15 - 0.1 - 0.02),
        ):
            a, b = placed(t, 0 * x, turn_a), placed(t, x, turn_b)
            found = motion.surface_distances(a, b, box, points)
            # A voxel is 3.3 mm; beyond the volume the distance is an upper bound.
            assert found == pytest.approx(expected, abs=3e-3)

    def test_a_gap_of_either_is_nan(self, ball):
        t = times(5)
        x = np.zeros((1, 5, 3))
        x[0, 1] = np.nan
        a = placed(t, 0 * np.nan_to_num(x), observed=np.arange(5) != 3)
        b = placed(t, np.add(x, [0.1, 0, 0]), 0 * np.nan_to_num(x), observed=np.arange(5) != 1)
        found = motion.surface_distances(a, b, *ball)
        assert np.isnan(found[0]).tolist() == [False, True, False, True, False]


class TestContacts:
    def test_a_ball_that_is_touched_twice(self):
        t = times(401)
        distance = 0.02 * (1 + np.cos(2 * np.pi * t / 2))  # 0 at 1 s and 3 s
        found = motion.contacts([distance], t, touching_m=0.01)
        third = 2 / 3  # the cosine is -0.5 or less in a third of a period of 2 s
        assert found.count.tolist() == [2]
        assert found.share[0] == pytest.approx(2 * third / 4, abs=0.01)
        assert found.onset_s[0] == pytest.approx(third, abs=0.01)
        assert found.nearest_m[0] == pytest.approx(0, abs=1e-12)

    def test_noise_at_the_threshold_makes_one_contact(self):
        t = times()
        rng = np.random.default_rng(2)
        distance = np.where((t > 0.5) & (t < 1.5), 0.001, 0.02)
        distance[120:124] = 0.02  # 40 ms
        distance[20:23] = 0.0
        found = motion.contacts([distance + 1e-4 * rng.normal(size=len(t))], t)
        assert found.count.tolist() == [1]
        assert found.share[0] == pytest.approx(0.5, abs=0.01)
        assert found.onset_s[0] == pytest.approx(0.51)

    def test_never_touching_is_no_contact_and_a_gap_is_not_known(self):
        t = times()
        apart, gap = np.full(len(t), 0.1), np.full(len(t), 0.1)
        gap[7] = np.nan
        found = motion.contacts([apart, gap], t)
        np.testing.assert_equal(found.count, [0, np.nan])
        np.testing.assert_equal(found.share, [0, np.nan])
        np.testing.assert_equal(found.onset_s, [np.nan, np.nan])
        np.testing.assert_equal(found.nearest_m, [0.1, np.nan])

    @pytest.mark.parametrize("n", [2, 3, 30, 200])
    @pytest.mark.parametrize("count", [1, 2, 5, 8])
    def test_stretches_are_those_of_the_slow_one(self, n, count):
        holds = np.random.default_rng(n + count).random((40, n)).repeat(3, axis=1)[:, :n] < 0.5
        found = settled(holds, 1.0, count)
        for row, one in zip(holds, found, strict=True):
            assert one.tolist() == slow_settled(row.tolist(), count).tolist()
        starts = [sum(1 for v, _ in groupby(row) if v) for row in found.tolist()]
        assert beginnings(found).sum(axis=1).tolist() == starts


class TestSymmetryIndex:
    def test_it_is_the_formula(self):
        assert motion.symmetry_index(1.1, 0.9).shape == ()
        assert motion.symmetry_index(1.1, 0.9) == pytest.approx(0.2)
        assert motion.symmetry_index([1.0, 0.0, 3.0], [1.0, 2.0, 0.0]).tolist() == [0, -2, 2]
        assert motion.symmetry_index(-1.5, -2.5) == pytest.approx(0.5)  # the left is the larger one

    def test_nothing_to_compare_is_nan(self):
        assert np.isnan(motion.symmetry_index([0.0, 1.0, np.nan], [0.0, -2.0, 1.0])).all()


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
