# SPDX-License-Identifier: MIT
"""A running camera: order, dropped frames, age, faults, and its end."""

import threading
import time

import numpy as np
import pytest

import sdftrack as st
from sdftrack.live import CameraLost, LiveCamera, open_camera
from sdftrack.live.camera import CAMERAS, CameraClock, CameraKind
from sdftrack.live.replay import Replay

CAMERA = st.Camera(20, 20, 7.5, 5.5, 16, 12)


def sequence(count=10):
    return st.Sequence(
        [st.Frame(np.full((12, 16), 0.5 + 0.01 * i, np.float32), timestamp=i / 30) for i in range(count)],
        CAMERA,
    )


def number(frame):
    return round((float(frame.depth[0, 0]) - 0.5) / 0.01)


class Steps:
    """A source that delivers a frame whenever the test lets it."""

    camera, name = st.RGBDCamera(CAMERA), "steps"

    def __init__(self, *frames):
        self.frames, self.gate, self.closed = list(frames), threading.Semaphore(0), 0

    def read(self):
        assert self.gate.acquire(timeout=10)
        item = self.frames.pop(0) if self.frames else None
        if isinstance(item, BaseException):
            raise item
        return item

    def reopen(self):
        pass

    def close(self):
        self.closed += 1

    def give(self, live, count):
        """Deliver so many frames, and wait until the camera's thread has them."""
        wanted = live.taken + count
        for _ in range(count):
            self.gate.release()
        for _ in range(2000):
            if live.taken == wanted:
                return
            time.sleep(0.001)
        raise AssertionError(f"{live.taken} frames taken, not {wanted}")


def test_frames_come_in_order_and_the_stream_ends():
    with LiveCamera(Replay(sequence(), fps=500), waiting=10) as live:
        frames = list(live)
    assert [number(f) for f in frames] == list(range(10))
    assert [f.index for f in frames] == list(range(10))
    assert (live.taken, live.dropped) == (10, 0)


def test_a_slow_program_loses_the_oldest_frames_and_they_are_counted():
    source = Steps(*sequence())
    with LiveCamera(source, waiting=2) as live:
        source.give(live, 3)
        assert number(live.next()) == 1
        assert live.dropped == 0  # nobody had asked for frame 0
        source.give(live, 5)
        assert [number(live.next()), number(live.next())] == [6, 7]
        assert live.dropped == 4
        source.gate.release(20)


def test_latest_drops_all_but_the_newest():
    source = Steps(*sequence())
    with LiveCamera(source, waiting=4) as live:
        source.give(live, 4)
        assert number(live.latest()) == 3
        assert live.dropped == 3
        source.gate.release(20)


def test_next_returns_none_after_its_time():
    source = Steps(*sequence())
    with LiveCamera(source) as live:
        assert live.next(timeout_s=0.01) is None
        source.gate.release(20)


def test_an_error_of_the_driver_is_raised_where_frames_are_asked_for():
    source = Steps(sequence()[0], RuntimeError("firmware"))
    source.gate.release(2)
    with LiveCamera(source) as live:
        assert live.next() is not None
        with pytest.raises(RuntimeError, match="firmware"):
            live.next()


def test_nothing_is_read_from_a_camera_that_could_not_be_opened_again(monkeypatch):
    monkeypatch.setattr("sdftrack.live.camera.RETRY_S", 0.001)
    calls = []

    class Away(Steps):
        def read(self):
            calls.append("read")
            return super().read()

        def reopen(self):
            calls.append("reopen")
            if calls.count("reopen") < 3:
                raise CameraLost("not connected")

    frames = sequence()
    source = Away(frames[0], CameraLost("no frame for 1 s"), frames[1])
    source.gate.release(4)
    with LiveCamera(source, waiting=10) as live:
        got = [f.error or number(f) for f in live]
    assert got == [0, "steps: no frame for 1 s", "steps: not connected", "steps: not connected", 1]
    assert calls == ["read", "read", "reopen", "reopen", "reopen", "read", "read"]


def test_a_source_whose_camera_is_refused_is_closed(monkeypatch):
    source = Steps()
    monkeypatch.setitem(CAMERAS, "steps", CameraKind("steps", "nothing", lambda address: source))
    with pytest.raises(ValueError, match="waiting"):
        open_camera("steps:", waiting=0)
    assert source.closed == 1


def test_closing_waits_for_the_thread_and_releases_the_source_once():
    source = Steps(*sequence())
    live = LiveCamera(source)
    source.gate.release(20)
    live.close()
    live.close()
    assert source.closed == 1
    assert not live._thread.is_alive()


def test_a_replay_keeps_the_rate_of_the_recording():
    start = time.monotonic()
    with LiveCamera(Replay(sequence(7)), waiting=10) as live:
        frames = list(live)
    assert time.monotonic() - start >= 5.5 / 30
    np.testing.assert_allclose(np.diff([f.timestamp for f in frames]).min(), 1 / 30, atol=1e-6)


def test_a_replay_that_loops_starts_again():
    with LiveCamera(Replay(sequence(3), fps=1000, loop=True), waiting=50) as live:
        assert [number(live.next()) for _ in range(7)] == [0, 1, 2, 0, 1, 2, 0]


@pytest.mark.parametrize(
    ("address", "options", "error", "words"),
    [
        ("realsens:", {}, ValueError, '"replay:" \\(a recorded sequence\\).*realsens:'),
        ("replay:/no/such/folder", {}, FileNotFoundError, "no such folder"),
        (3, {}, TypeError, "address: expected a text"),
        ("replay:seq", {"waiting": 0}, ValueError, "waiting: expected a number of frames, at least 1, got 0"),
        ("replay:seq", {"width": 640, "height": 480}, ValueError, "has 16 x 12, got 640 x 480"),
        ("replay:seq", {"fps": -1}, ValueError, "fps: expected frames per second above 0, got -1"),
    ],
)
def test_bad_addresses_and_options_are_refused(tmp_path, monkeypatch, address, options, error, words):
    monkeypatch.chdir(tmp_path)
    st.save_sequence("seq", sequence(3), layout="open3d")
    with pytest.raises(error, match=words):
        open_camera(address, **options)


def test_the_age_of_a_frame_on_the_computers_clock():
    clock = CameraClock()
    clock.arrived(100.0, 100.03)
    assert clock.age_s(100.0, 100.05) == pytest.approx(0.05)


def test_a_clock_that_drifts_does_not_make_frames_look_old():
    clock = CameraClock()
    for i in range(36000):  # 20 minutes at 30 Hz, 50 millionths slow
        clock.arrived(i / 30 * (1 - 5e-5), 7000 + i / 30 + 0.004)
    assert clock.age_s(35999 / 30 * (1 - 5e-5), 7000 + 35999 / 30 + 0.010) == pytest.approx(0.006, abs=5e-4)
    assert np.isnan(CameraClock().age_s(1.0, 2.0))


# -- the computer's clock is set back
HOUR_S = 3600.0


@pytest.fixture
def set_back(monkeypatch):
    """A function that sets the computer's clock back by an hour."""
    true, lost = time.time, [0.0]
    monkeypatch.setattr(time, "time", lambda: true() - lost[0])

    def turn() -> None:
        lost[0] += HOUR_S

    return turn


def test_a_replay_goes_on_and_its_times_increase(set_back, monkeypatch):
    slept: list[float] = []
    monkeypatch.setattr(time, "sleep", slept.append)
    replay = Replay(sequence(6), fps=50)
    first = replay.read()
    set_back()
    later = [replay.read() for _ in range(5)]
    assert max(slept) < 1  # an hour, if it waited for the clock
    assert (np.diff([f.timestamp for f in (first, *later)]) > 0.9 / 50).all()


def test_a_live_camera_knows_the_age_of_its_frames_again_at_once(set_back):
    source = Replay(sequence(6), fps=50)
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
