# SPDX-License-Identifier: MIT
"""Values of a movement while it happens."""

import json

import numpy as np
import pytest
from motion_cases import reaches

from sdftrack.motion import LiveMotion


def run(times, positions):
    live = LiveMotion()
    return [live.add(t, x) for t, x in zip(times, positions, strict=True)]


def test_repetitions_path_and_peak_speed_of_reaches():
    t = np.arange(400) / 30
    rng = np.random.default_rng(0)
    x = reaches(t, [1.0, 5.0, 9.0]) + 2e-4 * rng.standard_normal((400, 3))
    last = run(t, x)[-1]
    length = np.hypot(0.25, 0.1)
    assert last.repetitions == 3
    # Parts slower than 20 mm/s are left out, and the filter rounds the ends.
    assert last.path_m == pytest.approx(6 * length, rel=0.08)
    assert last.peak_speed_mps == pytest.approx(1.875 * length / 0.8, rel=0.1)
    # From and to a quarter of the way, which takes 0.29 s of the 0.8 s of each movement.
    assert last.last_repetition_s == pytest.approx(2.3 - 2 * 0.29, abs=0.1)


def test_a_resting_object_has_no_path():
    t = np.arange(900) / 30
    x = np.array([0, 0, 0.8]) + 5e-4 * np.random.default_rng(1).standard_normal((900, 3))
    last = run(t, x)[-1]
    assert last.repetitions == 0
    assert last.path_m < 0.01


def test_nothing_is_added_over_a_gap():
    live = LiveMotion()
    for k in range(30):
        live.add(k / 30, [0, 0, 0.8])
    for k in range(30, 90):
        live.add(k / 30, None)
    values = live.add(3.0, [0.4, 0, 0.8])
    assert values.path_m == 0
    assert values.speed_mps == 0
    assert values.distance_m == pytest.approx(0.4)


def test_times_that_do_not_increase_are_ignored():
    live = LiveMotion()
    live.add(1.0, [0, 0, 0.8])
    before = live.add(1.03, [0.01, 0, 0.8])
    assert live.add(1.03, [5, 0, 0.8]) == before
    assert live.add(0.5, [5, 0, 0.8]) == before
    assert live.add(float("nan"), [5, 0, 0.8]) == before
    assert live.add(1.06, [np.nan, 0, 0.8]) == before


def test_values_are_ready_for_json_before_the_first_repetition():
    values = LiveMotion().add(0.0, [0, 0, 0.8])
    assert json.loads(json.dumps(values.to_dict()))["last_repetition_s"] is None
    assert "0 repetitions" in values.text()
