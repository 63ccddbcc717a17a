# SPDX-License-Identifier: MIT
"""Clocks that are set back while a camera runs: nothing waits for the lost time, and every value says what it means."""

from __future__ import annotations

import time

import numpy as np
import pytest
from tracking_fakes import CAMERA, frame

import sdftrack as st
from sdftrack.live import LiveCamera
from sdftrack.live.camera import CameraClock
from sdftrack.live.replay import Replay

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
