# SPDX-License-Identifier: MIT
"""What the tracker asks of a memory: sure frames alone are learned, errors and other threads leave it whole."""

import threading

import numpy as np
import pytest
from contour_scenes import GROUND, RED, Told, disc_mask, painted

import sdftrack as st

FRAMES = 12
FADED = 0.15  # of the way from the object's colour to the ground's, at which a frame is weak, not lost


def disc(part=0.0, at=60.0):
    rgb = (1 - part) * np.array(RED) + part * np.array(GROUND)
    return painted(disc_mask(at, 60, 25), 8, int(at), rgb)


def begun(memory, burn_in=0):
    tracker = st.contour.ContourTracker(memory=memory, burn_in=burn_in)
    tracker.start(disc(), box=(33, 33, 54, 54))
    return tracker


@pytest.mark.parametrize("burn_in", [0, 2 * FRAMES], ids=["judging", "burn-in"])
def test_frames_of_unsure_colours_are_never_learned(burn_in):
    memory = Told()
    tracker = begun(memory, burn_in)
    statuses = [str(tracker.track(disc(FADED)).status) for _ in range(FRAMES)]
    assert statuses.count("weak") > 0
    assert len(memory.learned) == statuses.count("ok")


def test_after_an_answer_that_is_refused_the_track_goes_on():
    memory = Told("perhaps")
    tracker = begun(memory)
    with pytest.raises(ValueError, match="judgement"):
        tracker.track(disc(at=62))
    memory.say = "unoccluded"
    truth = disc(at=64)[..., 0] > 145
    result = tracker.track(disc(at=64))
    assert result.ok
    assert st.metrics.iou(result.mask, truth) > 0.9


def test_a_tracker_that_works_refuses_another_thread():
    memory = Told()
    tracker = begun(memory)
    said = []

    def other():
        try:
            tracker.track(disc())
        except RuntimeError as error:
            said.append(str(error))

    def inside():
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()

    memory.inside = inside
    assert tracker.track(disc()).ok
    assert len(said) == 1
    assert "another thread" in said[0]
    memory.inside = None
    assert tracker.track(disc()).ok


def test_a_memory_that_finds_every_shape_whole_changes_no_bit():
    plain, judged = begun(None), begun(Told())
    for at in (61, 63, 66):
        image = disc(at=at)
        one, two = plain.track(image), judged.track(image)
        for name in ("mask", "warp", "phi"):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        assert (one.status, one.confidence) == (two.status, two.confidence)


def test_while_a_memory_is_asked_the_warp_is_that_of_its_mask():
    memory = Told()
    tracker = begun(memory)
    warps = []
    memory.inside = lambda: warps.append(tracker.warp)
    before = tracker.warp
    result = tracker.track(disc(at=64))
    assert not np.array_equal(warps[0], before)
    np.testing.assert_array_equal(tracker.warp, result.warp)
    tracker.warp[...] = 0  # a copy
    np.testing.assert_array_equal(tracker.warp, result.warp)
