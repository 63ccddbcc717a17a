# SPDX-License-Identifier: MIT
"""Superpixels take calls written for scikit-image: what the core does not do, scikit-image itself does."""

import sys

import numpy as np
import pytest
from skimage import segmentation

import sdftrack as st

slic = st.superpixels.slic
rng = np.random.default_rng(3)
GREY, COLOR, VOLUME = rng.random((24, 30)), rng.random((24, 30, 3)), rng.random((8, 9, 10))
MASK = np.ones((24, 30)) * (np.arange(30) > 4)


@pytest.mark.parametrize(
    ("image", "arguments"),
    [
        (GREY, {"channel_axis": None}),
        ((1000 * GREY).astype(np.uint16), {"channel_axis": None}),
        ((1000 * GREY).astype(np.int64), {"channel_axis": None, "mask": MASK}),
        (GREY, {"channel_axis": None, "spacing": (1, 50)}),
        (GREY, {"channel_axis": None, "sigma": (1, 2)}),
        (GREY, {"channel_axis": None, "slic_zero": True}),
        (COLOR, {"channel_axis": -1, "convert2lab": False}),
        (COLOR, {"channel_axis": -1, "sigma": 2}),
        (1000 * COLOR, {"channel_axis": -1, "start_label": 0}),
        (COLOR[..., :2], {"channel_axis": -1, "enforce_connectivity": False}),
        (VOLUME, {"channel_axis": None}),
    ],
)
def test_what_the_core_does_not_do_scikit_image_does_with_our_defaults(image, arguments):
    theirs = segmentation.slic(image, 12, 0.3, **{"max_num_iter": 5, "min_size_factor": 0.25, **arguments})
    found = slic(image, 12, 0.3, **arguments)
    assert found.dtype == np.int32
    np.testing.assert_array_equal(found, theirs)


def test_channels_may_lie_on_any_axis():
    for axis in (0, 1, -2):
        moved = slic(np.moveaxis(COLOR, -1, axis), 4, channel_axis=axis)
        np.testing.assert_array_equal(moved, slic(COLOR, 4))
        np.testing.assert_array_equal(
            slic(np.moveaxis(COLOR, -1, axis), 4, channel_axis=axis, convert2lab=False),
            slic(COLOR, 4, convert2lab=False),
        )


def test_a_blur_wider_than_the_image_needs_no_memory():
    sigma = np.array([1e300, 0.0])
    assert slic(GREY, 4, channel_axis=None, sigma=sigma).shape == GREY.shape
    assert slic(GREY, 4, channel_axis=None, sigma=1e9).shape == GREY.shape
    assert sigma[0] == 1e300


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"channel_axis": 2}, ValueError, "channel_axis=2 indicates multichannel"),
        ({"channel_axis": "x"}, TypeError, "channel_axis: expected a whole number or None"),
        ({"channel_axis": None, "sigma": -1}, ValueError, "sigma: expected finite numbers of at least 0"),
        ({"channel_axis": None, "spacing": "x"}, TypeError, "spacing: expected a number for each axis"),
        ({"channel_axis": None, "compactness": 0}, ValueError, "compactness: expected a number above 0"),
        ({"channel_axis": None, "depth": GREY}, ValueError, "depth: not taken with scikit-image's arguments"),
        ({"edge": 1}, TypeError, "unexpected keyword argument 'edge'"),
    ],
)
def test_what_is_wrong_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        slic(GREY, 4, **arguments)


def test_values_that_are_not_finite_are_refused_unless_they_are_masked_out():
    image = np.where(MASK > 0, GREY, np.nan)
    with pytest.raises(ValueError, match="expected finite values, got NaN"):
        slic(image, 4, channel_axis=None)
    assert (slic(image, 4, channel_axis=None, mask=MASK)[MASK == 0] == 0).all()


def test_without_scikit_image_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "skimage.segmentation", None)
    with pytest.raises(ImportError, match=r"pip install 'sdftrack\[superpixels\]'"):
        slic(GREY, 4, channel_axis=None)
