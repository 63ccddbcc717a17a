# SPDX-License-Identifier: MIT
"""What contours, silhouettes, their memory, LWPR and superpixels refuse, in one line that names the argument."""

import functools

import numpy as np
import pytest
from refusals import assert_refused, refused

import sdftrack as st
from experiments.synth.gait import gait

HEIGHT, WIDTH = 90, 120
MASK = np.hypot(*(np.mgrid[:HEIGHT, :WIDTH] - np.array([45, 60])[:, None, None])) < 20
IMAGE = np.where(MASK[..., None], [200, 60, 40], [90, 100, 110]).astype(np.uint8)
SILHOUETTE = np.hypot(*(np.mgrid[:64, :64] - 31.5)) < 20
SPECK = np.zeros((2000, 2000), bool)
SPECK[3, 3] = True
SCATTERED = np.add.outer(np.arange(240), np.arange(320)) % 2 == 0
BLACK = np.zeros((240, 320, 3), np.uint8)
CORNER = np.arange(MASK.size).reshape(MASK.shape) > 4


def started(**options):
    tracker = st.contour.ContourTracker(**options)
    tracker.start(IMAGE, mask=MASK)
    return tracker


def begin(image=IMAGE, **place):
    return st.contour.ContourTracker().start(image, **place)


@refused(
    (lambda: started().track(IMAGE[..., 0]), ValueError, r"image: expected colours, .* got a grey image"),
    (lambda: started().track(IMAGE[:80]), ValueError, "image: .* at the start, 120 x 90, got 120 x 80"),
    (lambda: st.contour.ContourTracker().track(IMAGE), RuntimeError, "track: expected start"),
    (lambda: begin(IMAGE[:4, :4], mask=MASK[:4, :4]), ValueError, "image: expected at least 8 x 8"),
    (lambda: begin(), ValueError, "box, mask: expected one of them, got none"),
    (lambda: begin(box=(1, 2, 30, 30), mask=MASK), ValueError, "expected one of them, got both"),
    (lambda: begin(box=(200, 10, 30, 30)), ValueError, "box: expected a box in the 120 x 90 image"),
    (lambda: begin(box=(10, 10, 3, 3)), ValueError, "box: expected a box of at least 30"),
    (lambda: begin(box=(0, 0, 120, 90)), ValueError, "box: expected an object whose colours"),
    (lambda: begin(mask=np.zeros_like(MASK)), ValueError, "mask: expected at least 30 pixels"),
    (lambda: begin(mask=np.ones_like(MASK)), ValueError, "got a full mask"),
    (lambda: begin(mask=CORNER), ValueError, "expected background .*got 5; mark"),
    (lambda: begin(BLACK, mask=SCATTERED), ValueError, "scattered pixels; on a grid"),
)
def test_a_contour_that_cannot_be_followed_says_why(call, error, words):
    assert_refused(call, error, words)


@refused(
    (lambda: st.contour.harmonics(SILHOUETTE, 65), ValueError, "n: expected 1 to 64"),
    (lambda: st.contour.silhouette(np.zeros(9), 64, "sum"), ValueError, r"n \(n \+ 1\) / 2"),
    (lambda: st.contour.silhouette(np.full(9, np.nan), 64), ValueError, "finite"),
    (lambda: st.contour.ShapeMemory().learn(SPECK), ValueError, "nothing is left"),
    (lambda: st.contour.ShapeMemory(lwpr={"diagonal": False}), ValueError, "lwpr: expected only with"),
    (lambda: printed(lwpr={"w_gen": 0.2}), TypeError, r"'w_gen' is set by the memory; give"),
)
def test_a_silhouette_that_is_none_says_why(call, error, words):
    assert_refused(call, error, words)


def printed(**options):
    return st.contour.ShapeMemory(rule="printed", **options)


@pytest.mark.parametrize("rule", ["remembered", "printed"])
def test_a_memory_that_has_learnt_nothing_says_so(rule):
    memory = st.contour.ShapeMemory(rule=rule)
    for ask in (memory.judge, memory.recover, memory.assess, memory.observe):
        assert_refused(lambda ask=ask: ask(SILHOUETTE), RuntimeError, "nothing has been learned; call learn")


@functools.cache
def memory():
    learnt = st.contour.ShapeMemory()
    for mask in gait("cat", 12):
        learnt.learn(mask)
    return learnt


@refused(
    (lambda ask: ask(SILHOUETTE & False), ValueError, "^mask: .*some pixels inside"),
    (lambda ask: ask(SILHOUETTE | True), ValueError, "^mask: .*some pixels outside"),
    (lambda ask: ask(np.eye(32, dtype=bool)), ValueError, "^mask: .*shape of the learned masks"),
    (lambda ask: ask(np.ones((64, 64, 3), np.uint8)), ValueError, "^mask: .*an image"),
)
def test_bad_masks_are_refused_and_change_nothing(call, error, words):
    before = memory().n_learnt
    for ask in (memory().learn, memory().judge, memory().recover):
        assert_refused(call, error, words, ask)
    assert memory().n_learnt == before


@functools.cache
def model():
    return st.LWPR(2).update(np.random.default_rng(0).random((30, 2)), np.arange(30.0))


def learn(x, dtype=None):
    return model().update(np.array(x, dtype), [1.0])


@refused(
    (lambda: st.LWPR(init_D="best"), TypeError, "^init_D: .* or \"auto\", got 'best'"),
    (lambda: learn([["1", "2"]]), TypeError, r"^x: .*of text \(dtype <U1\); convert"),
    (lambda: learn([[1j, 2]]), TypeError, r"^x: .*of complex numbers .*with its .real"),
    (lambda: learn([["2020"]], "datetime64[D]"), TypeError, "^x: .*of dates"),
)
def test_samples_that_are_none_say_why(call, error, words):
    assert_refused(call, error, words)


DISC = np.hypot(*(np.mgrid[:HEIGHT, :WIDTH] - 40)) < 30
FLOATS = np.random.default_rng(0).random((HEIGHT, WIDTH, 3))
HUGE = np.broadcast_to(np.uint8(7), (2**16, 2**15))


def cut(image=IMAGE, n=40, *more, **options):
    return st.superpixels.slic(image, n, *more, **options)


@refused(
    (lambda: cut(IMAGE.astype(np.uint16)), TypeError, "image: expected uint8, or float in 0..1, got uint16"),
    (lambda: cut(IMAGE.astype(np.float32)), ValueError, "floats in 0..1, got .*divide"),
    (lambda: cut(np.array([[0.0, 1.0000001]]), 1), ValueError, r"got 0\.0\.\.1\.0000001"),
    (lambda: cut(HUGE, 10), ValueError, r"fewer than 2\^31 pixels"),
    (lambda: cut(compactness=1e6), ValueError, "compactness: .*up to 4000"),
    (lambda: cut(mask=MASK & False), ValueError, "mask: expected at least one pixel inside"),
    (lambda: cut(mask=DISC, start_label=0), ValueError, "start_label: expected at least 1 with a mask"),
    (lambda: cut(depth=np.ones(MASK.shape, np.uint16)), TypeError, "depth: expected metres"),
    (lambda: cut(depth=np.full(MASK.shape, 50.0)), ValueError, "depth_weight: .*50 m"),
    (lambda: cut(FLOATS[..., :2], channel_axis=-1, convert2lab=True), ValueError, "three channels, got 2"),
    (lambda: cut(FLOATS, slic_zero=True, distance="thesis"), ValueError, "distance: not taken"),
    (lambda: cut(FLOATS, convert2lab=False, depth=FLOATS[..., 0]), ValueError, "depth: not taken"),
    (lambda: st.superpixels.adjacency(np.full((2, 2), 2**64 - 1, np.uint64)), ValueError, r"below 2\^63"),
)
def test_superpixels_that_cannot_be_say_why(call, error, words):
    assert_refused(call, error, words)
