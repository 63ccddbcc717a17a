# SPDX-License-Identifier: MIT
"""ContourTracker.start of a tracker that runs already: as a fresh one, or, where it is refused, as if not asked."""

import numpy as np
import pytest

import sdftrack as st


def disc(cx, cy, radius, size=(160, 120)):
    y, x = np.mgrid[: size[1], : size[0]]
    mask = np.hypot(x - cx, y - cy) < radius
    noise = np.random.default_rng(0).normal(0, 5, (size[1], size[0], 1))
    return np.clip(np.where(mask[..., None], (200, 60, 40), (90, 100, 110)) + noise, 0, 255).astype(
        np.uint8
    ), mask


SMALL, LARGE, OTHER_SIZE = disc(40, 40, 12), disc(80, 60, 42), disc(120, 100, 70, (240, 200))
PLACES = {id(SMALL): (27, 27, 27, 27), id(LARGE): (37, 17, 87, 87), id(OTHER_SIZE): (49, 29, 143, 143)}


def by_box(picture):
    return {"box": PLACES[id(picture)]}


def by_mask(picture):
    return {"mask": picture[1]}


class Whole:
    """A memory that finds everything occluded and nothing missing."""

    def learn(self, mask):
        pass

    def judge(self, mask):
        return "occluded"

    def recover(self, mask):
        return mask


def same(a, b):
    for name in ("phi", "warp", "mask"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert (a.status, a.reason, a.confidence, a.judgement) == (b.status, b.reason, b.confidence, b.judgement)


@pytest.mark.parametrize("place", [by_box, by_mask])
@pytest.mark.parametrize("before", [SMALL, LARGE], ids=["small", "large"])
@pytest.mark.parametrize("after", [SMALL, LARGE, OTHER_SIZE], ids=["small", "large", "another size"])
@pytest.mark.parametrize("memory", [None, Whole()], ids=["no memory", "memory"])
def test_a_second_start_is_that_of_a_fresh_tracker(place, before, after, memory):
    used = st.contour.ContourTracker(memory=memory, burn_in=0)
    used.start(before[0], **place(before))
    for _ in range(3):
        used.track(before[0])
    fresh = st.contour.ContourTracker(memory=memory, burn_in=0)
    same(used.start(after[0], **place(after)), fresh.start(after[0], **place(after)))
    for _ in range(3):
        same(used.track(after[0]), fresh.track(after[0]))


def test_a_start_on_a_much_larger_grid_than_the_one_before_does_no_harm():
    # What was seen behind an occluder has the size of the old grid; read by the size of the new one it crashed.
    tracker = st.contour.ContourTracker(memory=Whole(), burn_in=0, most_cells=2048)
    small, mask = disc(100, 100, 10, (900, 900))
    large, _ = disc(450, 450, 300, (900, 900))
    tracker.start(small, mask=mask)
    assert tracker.track(small).judgement == "occluded"
    box = (145, 145, 611, 611)
    fresh = st.contour.ContourTracker(memory=Whole(), burn_in=0, most_cells=2048)
    same(tracker.start(large, box=box), fresh.start(large, box=box))


@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("size", [(160, 120), (240, 200)])
def test_after_a_start_that_is_refused_the_track_goes_on(lost, size):
    plain = np.full((size[1], size[0], 3), 100, np.uint8)
    empty = np.full_like(SMALL[0], 100)
    trackers = [st.contour.ContourTracker() for _ in range(2)]
    for tracker in trackers:
        tracker.start(SMALL[0], **by_mask(SMALL))
        tracker.track(empty if lost else SMALL[0])
    refused, left_alone = trackers
    with pytest.raises(ValueError, match="box: expected an object whose colours"):
        refused.start(plain, box=(5, 5, 120, 100))
    full = np.ones(plain.shape[:2], bool)
    full[0, :5] = False
    with pytest.raises(ValueError, match="mask: expected"):
        refused.start(plain, mask=full)
    for _ in range(3):
        same(refused.track(SMALL[0]), left_alone.track(SMALL[0]))
