# SPDX-License-Identifier: MIT
"""The errors of the experiment `lwpr`, one draw of each."""

from __future__ import annotations

import numpy as np

from experiments.lwpr import lwpr as cases
from experiments.synth.functions import cross, cross_data, surface_data


def test_the_cross_is_learnt_as_well_as_is_wanted():
    line = np.linspace(-1, 1, 41)
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    run = cases.measure(cross_data, grid, cross(grid), cases.CROSS["metric learnt"], 0, 1)
    assert run["nmse"][0] <= 0.0108  # the LWPR library's at its best settings
    assert run["within"] >= 95


def test_five_outputs_on_a_surface_in_ten_dimensions_are_learnt():
    places, truth = surface_data(10_000, 2000)
    run = cases.measure(surface_data, places, truth, cases.SURFACE["diagonal metric learnt"], 0, 1)
    assert max(run["nmse"]) <= 0.02
