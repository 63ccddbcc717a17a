# SPDX-License-Identifier: MIT
"""The first segmentation of a box."""

import cv2
import numpy as np
import pytest

import sdftrack as st
from sdftrack.metrics import iou

SIZE = (240, 180)
OWN_SHARE = 0.5  # of the object, in blots; the rest has the colours of the ground
RIGHT_IOU = 0.65
LARGE_IOU = 0.97
SMALL_IOU = 0.7
MOST_PX = 160  # a longer side is examined at a lower resolution


def blotched(seed):
    """An ellipse half of which has the colours of its ground."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    mask = np.hypot((x - 120) / 50, (y - 90) / 40) < 1
    chance = cv2.GaussianBlur(rng.uniform(0, 1, mask.shape), (0, 0), 4)
    own = mask & (chance > np.quantile(chance, 1 - OWN_SHARE))
    ground = rng.normal([90, 120, 60], 12, (*mask.shape, 3))
    image = np.where(own[..., None], rng.normal([120, 110, 60], 12, ground.shape), ground)
    return np.clip(image, 0, 255).astype(np.uint8), mask


@pytest.mark.parametrize("seed", range(3))
def test_the_place_in_the_box_closes_what_has_the_colours_of_the_ground(seed):
    image, mask = blotched(seed)
    box = cv2.boundingRect(mask.astype(np.uint8))
    found = {
        way: iou(st.contour.ContourTracker(box_start=way).start(image, box=box).mask, mask)
        for way in ("colors", "place")
    }
    assert found["place"] > RIGHT_IOU > found["colors"]


def test_nothing_is_found_beside_the_box():
    image, mask = blotched(0)
    x, y, w, h = cv2.boundingRect(mask.astype(np.uint8))
    result = st.contour.ContourTracker().start(image, box=(x, y, w, h // 2))
    beside = np.ones_like(mask)
    beside[y - 1 : y + h // 2 + 1, x - 1 : x + w + 1] = False  # the soft outline may move by a pixel
    assert not (result.mask & beside).any()


def test_a_large_box_is_segmented_at_a_lower_resolution():
    y, x = np.mgrid[:480, :640]
    mask = np.hypot((x - 320) / 200, (y - 240) / 150) < 1
    image = np.where(mask[..., None], [150, 90, 60], [90, 120, 60])
    image = np.clip(image + np.random.default_rng(0).normal(0, 12, image.shape), 0, 255).astype(np.uint8)
    box = cv2.boundingRect(mask.astype(np.uint8))
    assert max(box[2:]) > MOST_PX
    assert iou(st.contour.ContourTracker().start(image, box=box).mask, mask) > LARGE_IOU


def test_the_parts_of_a_small_object_are_not_smoothed_away():
    """A cross of bars of 6 px: the mean by the edges is over a part of the box, not over 3 px whatever its size."""
    mask = np.zeros((120, 160), bool)
    mask[45:75, 77:83] = mask[57:63, 65:95] = True
    image = np.where(mask[..., None], [150, 105, 60], [110, 120, 60])
    image = np.clip(image + np.random.default_rng(0).normal(0, 8, image.shape), 0, 255).astype(np.uint8)
    box = cv2.boundingRect(mask.astype(np.uint8))
    assert iou(st.contour.ContourTracker().start(image, box=box).mask, mask) > SMALL_IOU


def test_what_leaves_next_to_nothing_keeps_the_guess():
    """A ring thinner than the mean by the edges is smoothed away; what the colours alone say of it stays."""
    y, x = np.mgrid[:90, :120]
    ring = np.abs(np.hypot(x - 55, y - 45) - 14) < 1
    image = np.where(ring[..., None], [150, 90, 60], [90, 120, 60])
    image = np.clip(image + np.random.default_rng(0).normal(0, 8, image.shape), 0, 255).astype(np.uint8)
    guess, found = (
        st.contour.ContourTracker(box_start=way).start(image, box=(40, 30, 31, 31)).mask
        for way in ("colors", "place")
    )
    assert guess.any()
    np.testing.assert_array_equal(found, guess)
