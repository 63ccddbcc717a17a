# SPDX-License-Identifier: MIT
"""Contact and symmetry of two objects with known truth."""

from __future__ import annotations

import numpy as np
import pytest
from motion_cases import noisy, reaches

import sdftrack as st
from sdftrack import motion

TIMES = np.arange(240) / 30
RADIUS_M = 0.03


def sphere_points():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(400, 3))
    return RADIUS_M * x / np.linalg.norm(x, axis=1, keepdims=True)


def analyzed(gap_m, length_m=0.2, seed=0):
    """A ball that is carried along x, up to a ball that rests `gap_m` from where it stops, once or twice."""
    moving = reaches(TIMES, [1.0, 4.5], (length_m, 0, 0))
    resting = np.tile([length_m + 2 * RADIUS_M + gap_m, 0, 0.8], (len(TIMES), 1))
    return [
        motion.analyze(noisy(TIMES, x, seed=seed + k, sd_m=2e-4, sd_rad=2e-3, name=n))
        for k, (n, x) in enumerate((("moving", moving), ("resting", resting)))
    ]


@pytest.fixture(scope="module")
def ball():
    return st.SDF.sphere(RADIUS_M, voxels=64)


def test_balls_that_touch_twice(ball):
    found = motion.contact(*analyzed(0.0), ball, sphere_points())
    # The nearest of 400 points is up to 0.4 mm beside the axis on which spheres touch.
    assert found["surface_distance"].value == pytest.approx(0.0, abs=1e-3)
    assert found["contacts"].value == 2
    # Held for 0.7 s each, and within 3 mm for the last and first parts of the movements.
    assert 2 * 0.7 < found["contact_time"].value < 2 * 1.3
    assert found["contact_time"].low <= found["contact_time"].value <= found["contact_time"].high


def test_balls_that_stay_apart(ball):
    found = motion.contact(*analyzed(0.02), ball, sphere_points())
    assert found["surface_distance"].value == pytest.approx(0.02, abs=1e-3)
    assert found["contacts"].value == 0
    assert found["contact_time"].value == 0


def test_contact_needs_surface_points_and_a_time_in_common(ball):
    first, second = analyzed(0.0)
    with pytest.raises(ValueError, match=r"points_m: expected points \(K, 3\)"):
        motion.contact(first, second, ball, [1, 2, 3])
    later = motion.analyze(noisy(TIMES + 100, reaches(TIMES, [1.0])))
    with pytest.raises(ValueError, match="expected a trajectory of the same time"):
        motion.contact(first, later, ball, sphere_points())
    with pytest.raises(TypeError, match="first: expected"):
        motion.contact(None, second, ball, sphere_points())


def test_symmetry_of_equal_and_of_unequal_movements():
    left = motion.analyze(noisy(TIMES, reaches(TIMES, [1.0, 4.5], (0.2, 0, 0)), seed=1))
    same = motion.analyze(noisy(TIMES, reaches(TIMES, [1.0, 4.5], (-0.2, 0, 0)), seed=2))
    short = motion.analyze(noisy(TIMES, reaches(TIMES, [1.0, 4.5], (0.1, 0, 0)), seed=3))
    equal, unequal = motion.symmetry(left, same)["reach"], motion.symmetry(left, short)["reach"]
    assert equal.low < 0 < equal.high
    assert unequal.low < 200 * 0.1 / 0.3 < unequal.high
    assert motion.symmetry(short, left)["reach"].value == pytest.approx(-unequal.value)
