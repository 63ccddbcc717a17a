# SPDX-License-Identifier: MIT
"""Superpixels take calls written for scikit-image: channel axes, scales, blur, spacing, volumes, SLIC-zero."""

import numpy as np
import pytest

import sdftrack as st

slic = st.superpixels.slic


def quarters(*values, size=24):
    """An image of four squares, with a little noise."""
    a, b, c, d = (np.broadcast_to(np.asarray(v, float), (size, size, np.size(v))) for v in values)
    image = np.concatenate([np.concatenate([a, b], axis=1), np.concatenate([c, d], axis=1)], axis=0)
    return image + np.random.default_rng(1).uniform(0, 1e-3, image.shape)


QUARTERS = np.kron([[1, 2], [3, 4]], np.ones((24, 24), int))
GREY = quarters(0.1, 0.4, 0.6, 0.9)[..., 0]
COLOR = quarters((0.9, 0.1, 0.1), (0.1, 0.9, 0.1), (0.1, 0.1, 0.9), (0.9, 0.9, 0.1))


def test_grey_with_no_channel_axis_is_rescaled_whatever_its_type():
    wanted = slic(GREY, 4, compactness=0.1, channel_axis=None)
    np.testing.assert_array_equal(wanted, QUARTERS)
    for same in (1000 + 50 * GREY, -GREY[::-1, ::-1]):
        np.testing.assert_array_equal(slic(same, 4, compactness=0.1, channel_axis=None), wanted)
    for dtype in (np.uint16, np.int64, np.float16):
        np.testing.assert_array_equal(
            slic((1000 * GREY).astype(dtype), 4, compactness=0.1, channel_axis=None), wanted
        )


def test_channels_may_lie_on_any_axis():
    wanted = slic(COLOR, 4)
    np.testing.assert_array_equal(wanted, QUARTERS)
    for axis in (0, 1, -2):
        np.testing.assert_array_equal(slic(np.moveaxis(COLOR, -1, axis), 4, channel_axis=axis), wanted)


@pytest.mark.parametrize("channels", [2, 4, 8])
def test_other_numbers_of_channels(channels):
    rng = np.random.default_rng(2)
    image = quarters(*rng.random((4, channels)))
    np.testing.assert_array_equal(slic(image, 4, compactness=0.1, channel_axis=-1), QUARTERS)


def test_colours_are_not_converted_where_asked():
    with_lab, without = (
        slic(COLOR, 4, compactness=0.1, convert2lab=convert, channel_axis=-1) for convert in (True, False)
    )
    np.testing.assert_array_equal(with_lab, QUARTERS)
    np.testing.assert_array_equal(without, QUARTERS)
    rng = np.random.default_rng(3)
    image = rng.random((40, 50, 3))
    assert (slic(image, 30, convert2lab=False) != slic(image, 30)).any()
    scaled = (image - image.min()) / np.ptp(image)
    np.testing.assert_array_equal(
        slic(image, 30, compactness=0.2, convert2lab=False),
        slic(scaled, 30, compactness=20, color_space="rgb"),
    )


def test_a_volume_is_cut_into_its_eighths():
    truth = np.kron(np.arange(8).reshape(2, 2, 2), np.ones((6, 6, 6), int))
    volume = truth / 7 + np.random.default_rng(4).uniform(0, 1e-3, truth.shape)
    labels = slic(volume, 8, compactness=0.1, channel_axis=None)
    assert labels.dtype == np.int32
    np.testing.assert_array_equal(labels, truth + 1)
    color = np.random.default_rng(5).random((8, 3))[truth]
    np.testing.assert_array_equal(slic(color, 8, start_label=0), truth)
    mask = np.zeros(truth.shape)
    mask[2:-2, 2:-2, 2:-2] = 1
    masked = slic(volume, 8, compactness=0.1, channel_axis=None, mask=mask)
    np.testing.assert_array_equal(masked, np.where(mask > 0, truth + 1, 0))


def test_small_pieces_of_a_volume_join_their_largest_neighbour():
    volume = np.zeros((9, 9, 9))
    volume[4:, 4:, 4:] = 0.9
    volume[1, 1, 1] = 1
    labels = slic(volume, 2, compactness=0.01, channel_axis=None, max_num_iter=10)
    assert labels[1, 1, 1] == labels[0, 0, 0]
    np.testing.assert_array_equal(np.unique(labels), np.arange(1, labels.max() + 1))


def test_spacing_stretches_an_axis():
    image = np.random.default_rng(6).random((12, 12))
    tall = st.superpixels.regions(slic(image, 4, channel_axis=None, spacing=(1, 50)))
    wide = st.superpixels.regions(slic(image, 4, channel_axis=None, spacing=(50, 1)))
    assert tall.boxes[:, 3].mean() > tall.boxes[:, 2].mean()
    assert wide.boxes[:, 2].mean() > wide.boxes[:, 3].mean()
    even = slic(image, 4, channel_axis=None, spacing=(1, 1))
    np.testing.assert_array_equal(even, slic(image, 4, channel_axis=None, spacing=[1, 1]))


def test_sigma_blurs():
    rng = np.random.default_rng(7)
    image = np.clip(GREY + rng.normal(0, 0.3, GREY.shape), 0, 1)
    rough, smooth = (
        slic(image, 4, compactness=0.3, channel_axis=None, sigma=sigma, enforce_connectivity=False)
        for sigma in (0, 3)
    )
    assert (smooth == QUARTERS).mean() > (rough == QUARTERS).mean() + 0.1
    np.testing.assert_array_equal(
        smooth, slic(image, 4, compactness=0.3, channel_axis=None, sigma=(3, 3), enforce_connectivity=False)
    )
    with pytest.warns(FutureWarning, match="sigma number of elements must be 2"):
        slic(image, 4, channel_axis=None, sigma=(1, 3, 3))


def test_slic_zero_finds_its_own_compactness():
    # A contrast of 0.02: with a compactness of 10 nothing of it is seen, with an adaptive one it is.
    image = np.where(np.arange(40) < 15, 0.0, 1.0)[None].repeat(40, axis=0)
    plain, zero = (
        slic(image, 4, channel_axis=None, slic_zero=zero, max_num_iter=10, compactness=10)
        for zero in (False, True)
    )
    assert st.superpixels.boundaries(zero)[:, 14].all()
    assert not st.superpixels.boundaries(plain)[:, 14].all()


def test_a_sigma_of_many_images_is_the_mean_and_needs_no_memory():
    image = np.random.default_rng(2).random((40, 60))
    even = slic(image, 4, channel_axis=None, sigma=1e9)
    np.testing.assert_array_equal(even, slic(np.full((40, 60), image.mean()), 4, channel_axis=None))
    sigma = np.array([1e300, 0.0])
    slic(image, 4, channel_axis=None, sigma=sigma)
    assert sigma[0] == 1e300
