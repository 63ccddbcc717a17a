# SPDX-License-Identifier: MIT
"""What was lost comes back: elsewhere, at another size, turned; and what only looks like it is left alone."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack.metrics import iou

SIZE = (640, 360)
AWAY = 4  # frames without it
SOON = 3  # frames to be found in
BACK_IOU = 0.9  # of a disc or bar with noise; measured 0.97 to 1
GROUND, RED = (90, 100, 110), (200, 60, 40)


def scene(shape):
    """An image and mask of what `shape` says is inside, with noise."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]].astype(float)
    mask = shape(x, y)
    noise = np.random.default_rng(1).normal(0, 6, (SIZE[1], SIZE[0], 3))
    return np.clip(np.where(mask[..., None], RED, GROUND) + noise, 0, 255).astype(np.uint8), mask


def disc(cx, cy, radius):
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


@pytest.mark.parametrize("radius", [12, 15, 21, 30, 48, 60])
@pytest.mark.parametrize("place", [(90, 90), (330, 200), (570, 290)])
def test_a_disc_comes_back_anywhere_and_at_another_size(place, radius):
    tracker = lost(*disc(90, 90, 30))
    image, mask = disc(*place, radius)
    back = [tracker.track(image) for _ in range(SOON)][-1]
    assert back.ok
    assert iou(back.mask, mask) > BACK_IOU


@pytest.mark.parametrize("by", [0.5, 1.0, 1.8])
def test_a_bar_comes_back_across_the_image(by):
    tracker = lost(*bar(100, 80))
    image, mask = bar(480, 270, by)
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
    tracker = lost(*disc(90, 90, 30))
    image = scene(other)[0]
    for _ in range(10):
        result = tracker.track(image)
        assert result.status == st.Status.LOST
        assert not result.mask.any()
    image, mask = disc(500, 250, 30)
    back = [tracker.track(image) for _ in range(SOON)][-1]
    assert back.ok
    assert iou(back.mask, mask) > BACK_IOU


def test_a_search_finds_the_same_on_every_run():
    image = disc(500, 250, 22)[0]
    a, b = (lost(*disc(90, 90, 30)).track(image) for _ in range(2))
    np.testing.assert_array_equal(a.phi, b.phi)
    np.testing.assert_array_equal(a.warp, b.warp)
