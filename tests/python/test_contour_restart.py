# SPDX-License-Identifier: MIT
"""A contour begins again: by `start`, as with a fresh tracker, and by itself where what was lost comes back."""

import numpy as np
import pytest
from contour_scenes import Told, disc_mask, painted

import sdftrack as st
from sdftrack.metrics import iou


def disc(*place):
    mask = disc_mask(*place)
    return painted(mask, 5), mask


SMALL, LARGE, OTHER_SIZE = disc(40, 40, 12), disc(80, 60, 42), disc(120, 100, 70, (240, 200))
PLACES = {id(SMALL): (27, 27, 27, 27), id(LARGE): (37, 17, 87, 87), id(OTHER_SIZE): (49, 29, 143, 143)}


def by_box(picture):
    return {"box": PLACES[id(picture)]}


def by_mask(picture):
    return {"mask": picture[1]}


def same(a, b):
    for name in ("phi", "warp", "mask"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert (a.status, a.reason, a.confidence, a.judgement) == (b.status, b.reason, b.confidence, b.judgement)


@pytest.mark.parametrize("place", [by_box, by_mask])
@pytest.mark.parametrize("before", [SMALL, LARGE], ids=["small", "large"])
@pytest.mark.parametrize("after", [SMALL, LARGE, OTHER_SIZE], ids=["small", "large", "another size"])
@pytest.mark.parametrize("memory", [None, Told("occluded")], ids=["no memory", "memory"])
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
    tracker = st.contour.ContourTracker(memory=Told("occluded"), burn_in=0, max_cells=2048)
    small, mask = disc(100, 100, 10, (900, 900))
    large, _ = disc(450, 450, 300, (900, 900))
    tracker.start(small, mask=mask)
    assert tracker.track(small).judgement == "occluded"
    box = (145, 145, 611, 611)
    fresh = st.contour.ContourTracker(memory=Told("occluded"), burn_in=0, max_cells=2048)
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


# What was lost comes back: elsewhere, at another size, turned; what only looks like it is left alone.
SIZE = (640, 360)
AWAY = 4  # frames without it
SOON = 3  # frames to be found in
BACK_IOU = 0.9  # of a disc or bar with noise; measured 0.97 to 1


def scene(shape):
    """An image and mask of what `shape` says is inside, with noise."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]].astype(float)
    mask = shape(x, y)
    return painted(mask, 6, 1), mask


def round_at(cx, cy, radius):
    return scene(lambda x, y: np.hypot(x - cx, y - cy) < radius)


def bar(cx, cy, by=1.0):
    return scene(lambda x, y: (np.abs(x - cx) < 36 * by) & (np.abs(y - cy) < 14 * by))


NOTHING = scene(lambda x, y: np.zeros(x.shape, bool))[0]


def lost(first, mask):
    tracker = st.contour.ContourTracker()
    tracker.start(first, mask=mask)
    for _ in range(AWAY):
        result = tracker.track(NOTHING)
    assert result.status == st.Status.LOST
    return tracker


DISCS = [(*place, r) for place in ((90, 90), (330, 200), (570, 290)) for r in (12, 15, 21, 30, 48, 60)]
BACK = [(round_at, (90, 90, 30), disc) for disc in DISCS]
BACK += [(bar, (100, 80), (480, 270, by)) for by in (0.5, 1.0, 1.8)]


@pytest.mark.parametrize(("shape", "first", "later"), BACK)
def test_what_was_lost_comes_back_anywhere_and_at_another_size(shape, first, later):
    tracker = lost(*shape(*first))
    image, mask = shape(*later)
    back = [tracker.track(image) for _ in range(SOON)][-1]
    assert back.ok
    assert iou(back.mask, mask) > BACK_IOU


@pytest.mark.parametrize(
    "other",
    [
        lambda x, y: np.abs(y - 250) < 4,  # a red line
        lambda x, y: x > 300,  # half of the picture
        lambda x, y: (x // 6 + y // 6) % 2 < 1,  # a fine pattern of both
        lambda x, y: (np.abs(x - 480) < 110) & (np.abs(y - 270) < 5),  # far longer than it is wide
    ],
)
def test_the_colour_alone_is_not_the_object(other):
    tracker = lost(*round_at(90, 90, 30))
    image = scene(other)[0]
    for _ in range(10):
        result = tracker.track(image)
        assert result.status == st.Status.LOST
        assert not result.mask.any()
    image, mask = round_at(500, 250, 30)
    back = [tracker.track(image) for _ in range(SOON)][-1]
    assert back.ok
    assert iou(back.mask, mask) > BACK_IOU
