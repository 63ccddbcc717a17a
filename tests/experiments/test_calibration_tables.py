# SPDX-License-Identifier: MIT
"""Calibrations of the experiments: intervals of simulated pairs, rows of the intrinsics."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.calibration import intrinsics
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


def test_the_intrinsics_protocol_counts_refused_runs_as_missed():
    good = intrinsics.Run(
        np.full(4, 0.05), np.full(4, 0.05), np.ones(4, bool), np.zeros(4), np.full(4, 0.1), np.full(4, 0.1),
        np.ones(4, bool), 1.0, 1.0, 0, "ok",
    )  # fmt: skip
    row = intrinsics.row_of([good, good, "too few frames"], "1 mm")
    assert (row["runs"], row["refused"], row["within"]) == (3, 1, pytest.approx(2 / 3))
    assert row["rms"] == pytest.approx([0.05] * 4)
    assert row["accurate"] is False
    assert intrinsics.row_of([good], "1 mm")["accurate"] is True
    assert intrinsics.row_of(["no"], "1 mm") == {"runs": 1, "refused": 1, "reasons": ["no"]}
