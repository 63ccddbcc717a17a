# SPDX-License-Identifier: MIT
"""The contour tracker on recorded sequences, and the tables of the shape memory."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import check_grad

from experiments.contour.contour import follow_davis, open_davis
from experiments.contour.gplvm import GPLVM, LatentSearch


@pytest.mark.parametrize(("sequence", "by", "least"), [("cows", "mask", 0.82), ("camel", "mask", 0.75)])
def test_recorded_animals_are_followed(data_dir, sequence, by, least):
    if not (data_dir / "davis" / sequence).is_dir():
        pytest.skip(f"recorded data absent: {data_dir / 'davis' / sequence}")
    video = open_davis(data_dir / "davis", sequence, most=40)
    assert follow_davis(video, by).ious.mean() > least


def test_derivatives_of_the_latent_variable_model_are_those_of_its_costs():
    rng = np.random.default_rng(0)
    model = GPLVM(rng.normal(size=(12, 6)), q=2)
    there = np.append(model.X.ravel(), np.log([1.0, 0.8, 0.1])) + 0.1 * rng.normal(size=27)
    assert off(model._cost, there) < 1e-4  # of forward differences
    search = LatentSearch(model, rng.normal(size=(40, 6)))
    more_inside, outside = rng.uniform(-0.5, 0.5, 40), np.full(40, 0.6)
    assert (
        off(lambda x: search._cost(x, more_inside, outside), model.X[3] + 0.1) < 1e-4
    )  # of forward differences


def off(cost, there):
    """Difference of a derivative to finite differences over its length."""
    return check_grad(lambda x: cost(x)[0], lambda x: cost(x)[1], there) / np.linalg.norm(cost(there)[1])
