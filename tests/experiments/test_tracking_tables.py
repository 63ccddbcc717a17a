# SPDX-License-Identifier: MIT
"""Rows of the tracking experiments."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.common.sweeps import box_mesh
from experiments.tracking.random_starts import cup_axis


def test_the_bound_grows_with_the_noise(tmp_path, measured):
    (tmp_path / "meshes").mkdir()
    box_mesh(0.1).save(tmp_path / "meshes" / "box.ply")
    common = ["--only", "box", "--frames", "3", "--seeds", "1", "--voxels", "60"]
    more = ["--bound-only", "--sigma", "0.001,0.002"]
    (made,) = measured("synthetic", *common, *more, data=tmp_path)["tables"]
    one, two = (float(row[2]) for row in made["rows"])
    assert two == pytest.approx(2 * one, rel=1e-2)
    # Beside the first run's table, whose settings were others.
    _, made = measured("synthetic", *common, "--set", "max_pixels=2000", data=tmp_path)["tables"]
    assert made["numbers"][0]["frames"] == 3


def test_the_axis_of_a_cup_is_found():
    a = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    ring = 0.04 * np.column_stack([np.cos(a), np.sin(a)])
    walls = [np.column_stack([ring, np.full(60, z)]) for z in np.linspace(0, 0.09, 20)]
    handle = [[0.04 + 0.03 * np.sin(s), 0.0, 0.045 + 0.03 * np.cos(s)] for s in np.linspace(0, np.pi, 30)]
    cup = np.vstack([*walls, handle])
    for roll in range(3):  # along z, x, y in turn
        np.testing.assert_array_equal(cup_axis(np.roll(cup, roll, axis=1)), np.roll([0, 0, 1.0], roll))
