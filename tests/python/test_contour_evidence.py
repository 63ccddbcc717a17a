# SPDX-License-Identifier: MIT
"""Confidence of an outline by evidence, and the optical flow as a second cue."""

import cv2
import numpy as np
import pytest

import sdftrack as st
from experiments.synth.blob import blob_video
from sdftrack._core import EVIDENCE_MOST_INSTABILITY as MOST_INSTABILITY
from sdftrack._core import EVIDENCE_MOST_SHARED as MOST_SHARED
from sdftrack._core import EVIDENCE_SURE as SURE
from sdftrack._core import contour_verdict
from sdftrack.contour.result import Evidence
from sdftrack.metrics import iou
from sdftrack.results import Status

SIZE = (240, 180)
STEP_PX = 6
FRAMES = 8
GOOD = Evidence(0.05, 0.05, 0.05)


def texture(seed, size=SIZE):
    noise = np.random.default_rng(seed).uniform(0, 1, (size[1], size[0], 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 2)
    return np.clip(128 + 500 * (smooth - 0.5), 0, 255).astype(np.uint8)


def camouflage():
    """A disc that moves over a ground of the same colours."""
    ground, object_ = texture(0), texture(1)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    images, masks = [], []
    for k in range(FRAMES):
        mask = np.hypot(x - 80 - STEP_PX * k, y - 90) < 45
        moved = np.roll(object_, STEP_PX * k, axis=1)
        images.append(np.where(mask[..., None], moved, ground))
        masks.append(mask)
    return images, masks


@pytest.mark.parametrize("term", range(len(Evidence._fields)))
def test_each_term_alone_makes_an_outline_doubtful(term):
    bad = list(GOOD)
    bad[term] = 1.0
    status, reason, confidence = contour_verdict(Evidence(*bad), "ok", "")
    assert contour_verdict(GOOD, "ok", "")[2] >= SURE > confidence
    assert (status, bool(reason)) == ("weak", True)
    assert contour_verdict(GOOD, "ok", "")[:2] == ("ok", "")


def test_the_confidence_changes_no_outline():
    video = blob_video(frames=12)
    results = []
    for confidence in ("colors", "evidence"):
        tracker = st.contour.ContourTracker(confidence=confidence)
        tracker.start(video.images[0], mask=video.masks[0])
        results.append([tracker.track(image) for image in video.images[1:]])
    for a, b in zip(*results, strict=True):
        np.testing.assert_array_equal(a.mask, b.mask)
        assert a.evidence is None
        assert b.evidence is not None
        assert b.confidence == contour_verdict(b.evidence, "ok", "")[2] != a.confidence


def test_flow_follows_what_has_the_colours_of_its_ground():
    images, masks = camouflage()
    found = {}
    for motion in ("none", "flow"):
        tracker = st.contour.ContourTracker(motion=motion)
        tracker.start(images[0], mask=masks[0])
        found[motion] = np.mean(
            [iou(tracker.track(i).mask, m) for i, m in zip(images[1:], masks[1:], strict=True)]
        )
    assert found["flow"] > 0.9
    assert 1 - found["flow"] < 0.6 * (1 - found["none"])


def two_grounds(left_right):
    """A disc of one colour, and a ground whose colour beside it depends on which side is looked at."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    mask = np.hypot(x - 120, y - 90) < 40
    rng = np.random.default_rng(0)
    ground = np.where((x < 120)[..., None], *left_right)
    image = np.where(mask[..., None], [170, 60, 60], ground) + rng.normal(0, 8, (*mask.shape, 3))
    return np.clip(image, 0, 255).astype(np.uint8), mask


CLEAR = ([60, 120, 60], [60, 60, 140])


def test_a_clear_box_is_sure_and_a_mask_is_not_doubted():
    image, mask = two_grounds(CLEAR)
    box = cv2.boundingRect(mask.astype(np.uint8))
    start = st.contour.ContourTracker().start(image, box=box)
    assert start.ok
    assert 0 < start.evidence.first_instability < MOST_INSTABILITY
    tracker = st.contour.ContourTracker()
    assert tracker.start(image, mask=mask).evidence is None
    assert tracker.track(image).evidence.first_instability == 0


def test_a_first_mask_that_changes_with_the_box_is_never_ok():
    ground, object_ = (
        texture(0),
        np.clip(texture(1) + np.array([10.0, 0, 0]), 0, 255),
    )  # of nearly the same colours
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    mask = np.hypot(x - 120, y - 90) < 40
    image = np.where((mask & (x < 120))[..., None], object_, ground).astype(np.uint8)
    tracker = st.contour.ContourTracker()
    start = tracker.start(image, box=cv2.boundingRect(mask.astype(np.uint8)))
    assert start.evidence.first_instability > MOST_INSTABILITY
    for result in (start, tracker.track(image), tracker.track(image)):
        assert result.status == Status.WEAK
        assert result.confidence < SURE
        assert "the first mask changes with the box" in result.reason


def beside_its_own_colours(share, seed=0):
    """A disc before a ground that has its colours in a sector of `share` of the outline; the mask, four images."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    mask = np.hypot(x - 120, y - 90) < 45
    alike = np.arctan2(y - 90, x - 120) < np.pi * (2 * share - 1)
    clean = np.where((mask | alike)[..., None], [110, 108, 100], [60, 130, 70])
    rng = np.random.default_rng(seed)
    textures = [cv2.GaussianBlur(rng.normal(0, 1, (*mask.shape, 3)), (0, 0), 1.5) * 30 for _ in range(4)]
    return mask, [np.clip(clean + t, 0, 255).astype(np.uint8) for t in textures]


@pytest.mark.parametrize(("share", "seed"), [(0.0, 1), (0.25, 2), (0.75, 3), (1.0, 4)])
def test_an_outline_beside_the_objects_own_colours_is_not_ok(share, seed):
    mask, images = beside_its_own_colours(share, seed)
    tracker = st.contour.ContourTracker()
    tracker.start(images[0], mask=mask)
    for image in images[1:]:
        result = tracker.track(image)
        if share <= MOST_SHARED:
            assert (result.ok, result.evidence.shared <= MOST_SHARED) == (True, True)
        else:
            assert result.status == Status.WEAK
            assert result.confidence <= 1 - MOST_SHARED
            assert "the object has the colours of its surroundings along" in result.reason


def test_that_its_colours_were_those_of_its_surroundings_is_remembered():
    mask, images = beside_its_own_colours(1.0)
    _, others = beside_its_own_colours(0.0)
    tracker = st.contour.ContourTracker()
    tracker.start(images[0], mask=mask)
    doubted = tracker.track(images[1]).evidence.shared
    assert tracker.track(others[2]).evidence.shared == pytest.approx(0.995 * doubted, abs=1e-9)
    assert tracker.start(others[0], mask=mask).ok
    assert tracker.track(others[1]).evidence.shared < 0.2
