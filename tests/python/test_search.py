# SPDX-License-Identifier: MIT
"""A pose without a first pose: the search behind start(masks=, boxes=) and recovery."""

import numpy as np
import pytest
from tracking_scene import CAMERA, POSE, SIZE_M, depth_of

import sdftrack as st
from sdftrack import _core, metrics
from sdftrack.eval.real import half_turns

FOUND_M = 0.003  # ADD of a found box; noise is 1 mm, a wrong local minimum is beyond 10 mm


def searcher_of(sdf):
    return _core.Searcher((sdf.values, sdf.voxel_size, sdf.origin.tolist()), st.TrackerOptions()._to_core())


@pytest.fixture(scope="module")
def searcher():
    return searcher_of(st.SDF.box(SIZE_M))


def mask_of(T=POSE):
    return (depth_of(T, noise_m=0) < 1).astype(np.uint8)


def least_add(T):
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * SIZE_M
    return min(metrics.add(T, POSE @ S, corners) for S in half_turns(np.zeros(3)))


def test_a_box_is_found_from_its_mask(searcher):
    found = searcher.search(depth_of(), CAMERA._core, mask=mask_of())
    assert least_add(found[0]["pose"]) < FOUND_M


def test_the_same_bits_come_from_any_number_of_threads(searcher):
    one, three = (searcher.search(depth_of(), CAMERA._core, mask=mask_of(), threads=n) for n in (1, 3))
    assert len(one) == len(three)
    for a, b in zip(one, three, strict=True):
        assert a["score"] == b["score"]
        np.testing.assert_array_equal(a["pose"], b["pose"])


def test_the_half_turns_of_a_box_score_as_much_as_the_first(searcher):
    found = searcher.search(depth_of(), CAMERA._core, mask=mask_of())
    assert found[1]["score"] > 0.9 * found[0]["score"]


@pytest.mark.parametrize("mask", [np.zeros(CAMERA.shape, np.uint8), np.ones(CAMERA.shape, np.uint8)])
def test_nothing_to_look_at_is_an_empty_list(searcher, mask):
    depth = depth_of() if not mask.any() else np.zeros(CAMERA.shape, np.float32)
    assert searcher.search(depth, CAMERA._core, mask=mask) == []
