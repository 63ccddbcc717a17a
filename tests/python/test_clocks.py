# SPDX-License-Identifier: MIT
"""Clocks that are set back while a camera runs: nothing waits for the lost time, and every value says what it means."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from tracking_fakes import CAMERA, frame, pose, result

import sdftrack as st
from sdftrack.live import LiveCamera
from sdftrack.live.camera import CameraClock
from sdftrack.live.replay import Replay
from sdftrack.motion import LiveMotion

HOUR_S = 3600.0


@pytest.fixture
def set_back(monkeypatch):
    """A function that sets the computer's clock back by an hour."""
    true, lost = time.time, [0.0]
    monkeypatch.setattr(time, "time", lambda: true() - lost[0])

    def turn() -> None:
        lost[0] += HOUR_S

    return turn


def recording(count=6):
    return st.Sequence([frame(i) for i in range(count)], CAMERA, None, {})


def test_a_replay_goes_on_and_its_times_increase(set_back, monkeypatch):
    slept: list[float] = []
    monkeypatch.setattr(time, "sleep", slept.append)
    replay = Replay(recording(), fps=50)
    first = replay.read()
    set_back()
    later = [replay.read() for _ in range(5)]
    assert max(slept) < 1  # an hour, if it waited for the clock
    assert (np.diff([f.timestamp for f in (first, *later)]) > 0.9 / 50).all()


def test_a_live_camera_knows_the_age_of_its_frames_again_at_once(set_back):
    source = Replay(recording(), fps=50)
    with LiveCamera(source, waiting=10) as live:
        live.next()
        set_back()
        last = [live.next(timeout_s=20) for _ in range(5)][-1]
        age_s = live.age_s(last)
    assert abs(age_s) < 5


def test_a_clock_that_is_set_back_is_a_new_difference():
    clock = CameraClock()
    clock.arrived(10.0, 5000.02)
    clock.arrived(10.1, 5000.12 - HOUR_S)
    assert clock.age_s(10.1, 5000.15 - HOUR_S) == pytest.approx(0.03)


def test_running_values_of_a_movement_wait_for_the_time_they_have_seen():
    live = LiveMotion()
    for k in range(30):
        before = live.add(k / 30, [0.01 * k, 0, 0.8])
    assert live.add(0.5, [9, 9, 9]) == before  # as documented: ignored
    assert live.add(1.0, [0.3, 0, 0.8]).path_m > before.path_m


def test_a_recorder_writes_the_times_as_they_came(tmp_path):
    stamps = [10.0, 10.1, 9.0, 9.1]
    with st.Recorder(tmp_path / "out", CAMERA) as recorder:
        for i, stamp in enumerate(stamps):
            shown = frame(i).replace(timestamp=stamp)
            recorder.add(shown, dataclasses.replace(result([pose()], None, i), timestamp=stamp))
    rows = np.loadtxt(tmp_path / "out" / "trajectory_0.txt")
    np.testing.assert_allclose(rows[:, 0], stamps)


def test_a_trajectory_whose_times_go_back_is_refused_and_names_the_frames():
    times = np.array([0.0, 0.1, 0.2, 0.15, 0.3])
    with pytest.raises(ValueError, match=r"strictly increasing times, but they are .* at frames 2 and 3"):
        st.motion.Trajectory(times, np.tile(np.eye(4), (5, 1, 1)))
