# SPDX-License-Identifier: MIT
"""Running values of an exercise: causal, in constant memory."""

from __future__ import annotations

import json
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest
from motion_cases import noisy, reaches
from scipy.spatial.transform import Rotation

import sdftrack as st
from sdftrack import motion
from sdftrack.motion.live import LiveMotion

TIMES = np.arange(360) / 30
STARTS = (1.0, 4.0, 8.0)
LATE_S = 0.35  # a filter that looks back only sees a rest later than it begins; measured 0.27


def results(*trajectories):
    """One result per frame, as far as LiveMotion reads them."""
    for i, time in enumerate(trajectories[0].times_s):
        yield SimpleNamespace(
            timestamp=float(time),
            poses=np.array([t.poses[i] for t in trajectories]),
            status=[st.Status(t.status[i]) for t in trajectories],
        )


def followed(*trajectories, **options):
    """The values after each frame."""
    live = LiveMotion([t.name for t in trajectories], **options)
    return [live.add(r) for r in results(*trajectories)]


def cup(starts=STARTS, **fields):
    return noisy(TIMES, reaches(TIMES, starts, (0.25, -0.1, 0.0)), name="cup", **fields)


def test_repetitions_are_counted_when_they_end():
    counts = np.array([v["cup"]["repetitions"] for v in followed(cup())])
    assert counts[-1] == 3
    assert (np.diff(counts) >= 0).all()
    ends = TIMES[np.flatnonzero(np.diff(counts)) + 1]
    np.testing.assert_allclose(ends, np.array(STARTS) + 2.3, atol=LATE_S)


def test_values_are_near_those_of_the_whole_recording():
    last = followed(cup())[-1]["cup"]
    whole = motion.analyze(cup())
    assert last["peak_speed_mps"] == pytest.approx(whole.averages["peak_speed_move"].value, rel=0.15)
    assert last["path_length_m"] == pytest.approx(3 * whole.averages["path_length"].value, rel=0.1)
    assert last["last_repetition_s"] == pytest.approx(whole.averages["repetition_time"].value, abs=0.3)


def test_what_comes_later_does_not_change_what_was_said():
    values = followed(cup())
    short = followed(cup().part(slice(0, 150)))
    assert short == values[:150]


def test_noise_at_rest_is_neither_path_nor_repetition():
    last = followed(cup(starts=()))[-1]["cup"]
    assert last["repetitions"] == 0
    assert last["path_length_m"] < 0.02
    assert last["last_repetition_s"] is None


@pytest.mark.parametrize("radius", [0.05, 0.15])
def test_circles_without_a_halt_are_counted(radius):
    angle = 2 * np.pi * np.clip(TIMES - 1, 0, 9) / 1.8
    circle = radius * np.column_stack([np.cos(angle) - 1, np.sin(angle), 0 * angle]) + [0, 0, 0.8]
    assert followed(noisy(TIMES, circle, name="cup"))[-1]["cup"]["repetitions"] == 5


def test_turns_in_place_are_counted_by_rotation():
    angle = 4 * reaches(TIMES, STARTS)[:, 0]
    turning = Rotation.from_rotvec(np.outer(angle, [0, 1.0, 0]))
    still = noisy(TIMES, reaches(TIMES, ()), turning, name="cup")
    assert followed(still, by="rotation")[-1]["cup"]["repetitions"] == 3
    assert followed(still)[-1]["cup"]["repetitions"] == 0


def test_a_jump_in_a_gap_is_no_path_and_no_speed():
    x = np.where(TIMES[:, None] > 5, [0.5, 0, 0.8], [0.0, 0, 0.8])
    status = np.where((TIMES > 4.5) & (TIMES < 5.5), "lost", "ok").tolist()
    values = followed(noisy(TIMES, x, name="cup", status=status))
    assert values[-1]["cup"]["path_length_m"] < 0.05
    assert values[-1]["cup"]["peak_speed_mps"] < 0.1
    assert values[150]["cup"]["speed_mps"] is None
    json.dumps(values, allow_nan=False)


def test_two_objects_are_counted_each():
    spoon = noisy(TIMES, reaches(TIMES, (5.0,)), seed=3, name="spoon")
    last = followed(cup(), spoon)[-1]
    assert [last[n]["repetitions"] for n in ("cup", "spoon")] == [3, 1]


def test_a_frame_that_is_not_later_is_ignored():
    live, frames = LiveMotion(["cup"]), list(results(cup()))
    for frame in frames[:60]:
        before = live.add(frame)
    assert live.add(frames[59]) == live.add(frames[30]) == before


def test_memory_does_not_grow():
    live, frames = LiveMotion(["cup"]), list(results(cup()))

    def hour(rounds, start):
        for k in range(rounds):
            for frame in frames:
                live.add(SimpleNamespace(**{**vars(frame), "timestamp": frame.timestamp + 12 * (k + start)}))

    hour(1, 0)
    tracemalloc.start()
    hour(1, 1)
    before = tracemalloc.get_traced_memory()[0]
    hour(20, 2)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 5000  # bytes, of 7200 frames


def test_bad_arguments_are_told():
    for names in ([], ["a", "a"], "cup"):
        with pytest.raises(ValueError, match="names"):
            LiveMotion(names)
    with pytest.raises(ValueError, match="by: expected position or rotation"):
        LiveMotion(["cup"], by="weight")
    frame = next(results(cup()))
    with pytest.raises(ValueError, match="expected 2 objects"):
        LiveMotion(["cup", "spoon"]).add(frame)
    frame.timestamp = None
    with pytest.raises(ValueError, match="timestamp"):
        LiveMotion(["cup"]).add(frame)
