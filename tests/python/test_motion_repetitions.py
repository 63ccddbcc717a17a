# SPDX-License-Identifier: MIT
"""Repetitions and phases of movements with known truth."""

import numpy as np
import pytest
from motion_cases import noisy, reaches
from scipy.spatial.transform import Rotation

from sdftrack import motion

STARTS = [1.0, 4.5, 8.0]
MOVE_S, HOLD_S = 0.8, 0.7


def found(positions, times, rotations=None, **options):
    s = motion.smooth(noisy(times, positions, rotations, **options))
    return s, motion.find_repetitions(s)


def test_a_repetition_lasts_from_the_first_movement_to_the_end_of_the_last_with_a_hold_between():
    t = np.arange(360) / 30
    s, repetitions = found(reaches(t, STARTS), t)
    assert motion.count_interval(s) == (3, 3, 3)
    for start, repetition in zip(STARTS, repetitions, strict=True):
        assert repetition.start_s == pytest.approx(start, abs=0.15)
        assert repetition.end_s == pytest.approx(start + 2 * MOVE_S + HOLD_S, abs=0.15)
        assert [p.name for p in repetition.phases] == ["move", "hold", "return"]
        hold = repetition.phases[1]
        assert hold.start_s == pytest.approx(start + MOVE_S, abs=0.2)
        assert hold.end_s == pytest.approx(start + MOVE_S + HOLD_S, abs=0.2)


def test_a_movement_there_and_back_without_a_halt_is_one_phase():
    t = np.arange(360) / 30
    _, repetitions = found(reaches(t, STARTS, hold_s=-0.3), t)
    assert [[p.name for p in r.phases] for r in repetitions] == [["move"]] * 3


@pytest.mark.parametrize("around_start", [False, True])
def test_circles_drawn_without_a_halt_are_counted(around_start):
    """Also if the object is at the middle of the circle when the recording begins."""
    t = np.arange(450) / 30
    turn = np.interp(t, [1, 2, 12, 13], [0, 0.5 * np.pi, 9.5 * np.pi, 10 * np.pi])
    radius = 0.1 * (np.interp(t, [1, 2, 12, 13], [0, 1, 1, 0]) if around_start else np.ones_like(t))
    x = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full_like(t, 0.8)])
    _, repetitions = found(x, t)
    assert len(repetitions) == 5


def test_turns_without_a_change_of_position_are_counted_by_rotation():
    t = np.arange(360) / 30
    angle = 4 * (reaches(t, STARTS)[:, 0])
    R = Rotation.from_rotvec(np.column_stack([angle, 0 * t, 0 * t]))
    _, repetitions = found(np.tile([0, 0, 0.8], (len(t), 1)), t, R)
    # 5 mrad of noise are 0.02 rad/s after smoothing, half of the threshold: the start is known less well.
    assert [r.start_s for r in repetitions] == pytest.approx(STARTS, abs=0.2)


def test_small_hesitations_are_no_repetitions():
    t = np.arange(360) / 30
    x = reaches(t, STARTS)
    x[:, 0] += 0.02 * np.sin(2 * np.pi * 2 * t) * (np.abs(x[:, 0] - 0.25) < 0.02)
    assert len(found(x, t)[1]) == 3


def test_tremor_in_a_hold_is_no_movement():
    t = np.arange(360) / 30
    x = reaches(t, [1.0], move_s=1.0, hold_s=6.0)
    x[:, 1] += 0.002 * np.sin(2 * np.pi * 6 * t) * (x[:, 0] > 0.2)
    _, repetitions = found(x, t)
    assert [p.name for p in repetitions[0].phases] == ["move", "hold", "return"]
