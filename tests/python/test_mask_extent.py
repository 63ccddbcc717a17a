# SPDX-License-Identifier: MIT
"""A reconstruction that has grown beyond the mask that it began with says so."""

import numpy as np
from reconstruction_scene import CAMERA, first_mask, sequence

import sdftrack as st

FREE = {"keep_to_mask": False, "planes": False, "voxels": 64, "mode": "depth"}


def run(mask, **options):
    seq = sequence()
    star = st.Reconstructor(CAMERA, **{**FREE, **options})
    return star, [star.start(seq[0], mask=mask), *(star.track(seq[i]) for i in range(1, 12))]


def test_another_recording_that_is_added_is_ok_and_what_follows_is_weak():
    seq = sequence()
    star, results = run(half(first_mask(seq)))
    assert not results[-1].ok
    result = star.resume(seq[12], mask=seq.masks(12)[0])
    assert result.ok
    assert result.index == 12
    assert star.track(seq[13]).status == ["weak"]


def half(mask):
    """The mask without its left half: what is there joins the shape."""
    out = mask.copy()
    xs = np.nonzero(mask)[1]
    out[:, : int(np.median(xs))] = False
    return out


def test_a_shape_that_has_grown_beyond_its_mask_is_weak_with_the_reason():
    _, results = run(half(first_mask(sequence())))
    assert results[-1].status == ["weak"]
    assert "beyond the first mask" in results[-1].reason[0]
    assert results[-1].confidence[0] <= 0.5


def test_one_whose_mask_shows_all_of_it_is_not():
    assert all(r.ok or r.reason[0].startswith("undetermined") for r in run(first_mask(sequence()))[1])


def test_where_the_mask_bounds_the_shape_nothing_is_doubted():
    assert not any("beyond" in r.reason[0] for r in run(half(first_mask(sequence())), keep_to_mask=True)[1])
