# SPDX-License-Identifier: MIT
"""Calibrations of the experiments: intervals of simulated pairs, rows of the intrinsics."""

from __future__ import annotations

import pytest

from experiments.calibration.ball import coverage_of_pairs

COVERED = (0.90, 0.985)  # 50 runs of 12 and 20 correlated numbers: 95 % to within 3 sd of about 1.5 %


def test_intervals_hold_the_truth_as_often_as_they_say():
    parameters, points = coverage_of_pairs(50)
    assert COVERED[0] < parameters < COVERED[1]
    assert COVERED[0] < points < COVERED[1]


@pytest.mark.parametrize("pairs", [6, 8, 12])
def test_intervals_of_mapped_points_hold_with_few_pairs_too(pairs):
    _, points = coverage_of_pairs(40, pairs)
    assert COVERED[0] < points < 0.995  # cautious by the stated noise, which so few cannot measure
