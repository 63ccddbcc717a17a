# SPDX-License-Identifier: MIT
"""What is counted of confidence and covariance."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.trust.confidence import area_under_roc
from experiments.trust.coverage import coverage


def test_the_area_under_roc_counts_pairs():
    score, right = np.array([0.1, 0.4, 0.4, 0.9]), np.array([False, False, True, True])
    assert area_under_roc(score, right) == pytest.approx((1 + 0.5 + 1 + 1) / 4)
    assert np.isnan(area_under_roc(score, np.ones(4, bool)))


def test_coverage_is_95_percent_of_gaussian_errors():
    rng = np.random.default_rng(0)
    L = np.diag([1, 2, 3, 0.1, 0.2, 0.3]) @ (np.eye(6) + 0.3 * rng.normal(size=(6, 6)))
    errors = rng.normal(size=(4000, 6)) @ L.T
    c = coverage(errors, np.tile(L @ L.T, (4000, 1, 1)))
    held = np.array([*c.directions, c.position, c.rotation, c.joint])
    np.testing.assert_allclose(held, 0.95, atol=0.0104)  # 3 sd of a share of 4,000
    np.testing.assert_allclose(c.spread, 1, atol=0.034)
    over_sure = coverage(2 * errors, np.tile(L @ L.T, (4000, 1, 1)))
    assert over_sure.joint < 0.6
