# SPDX-License-Identifier: MIT
"""Silhouettes as cosine series: against scipy and the sums of the text, cases with known answers, bad input."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack.contour.dct import block_of, count, harmonic_numbers, series, transformed

ORDERS = ["max", "sum"]
ROUNDING = 1e-11  # sums of 4,096 numbers of about 1, in double; measured 3e-15
FLOAT32 = 1e-4  # shares of pixels are float32, sums of 4,096 of them
TO_AN_EIGHTH_PX = 0.13  # distances are sampled four times per pixel
CURVED_PX = 0.1  # an octagon-like digital disc against the true circle, beside that
SMOOTH_IOU = 0.97  # a disc of 20 pixels cut to 20 harmonics; measured 0.985
GRID_PX = 0.5  # a centroid of a mask moved by whole areas of pixels


@pytest.fixture(scope="module")
def noise():
    return np.random.default_rng(0).random((64, 64)) > 0.5


def disc(size, radius, x=None, y=None):
    middle = (size - 1) / 2
    rows, columns = np.indices((size, size))
    return np.hypot(columns - (middle if x is None else x), rows - (middle if y is None else y)) < radius


@pytest.mark.parametrize("order", ORDERS)
def test_harmonics_are_scipys_orthonormal_cosine_transform(noise, order):
    fft = pytest.importorskip("scipy.fft")
    full = fft.dctn(2.0 * noise - 1, norm="ortho")
    u, v = np.indices(full.shape)
    number = np.maximum(u, v) + 1 if order == "max" else u + v + 1
    c = st.contour.harmonics(noise, 10, order)
    layout = [(0, 0), (0, 1), (1, 1), (1, 0), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0)]  # along each shell
    if order == "sum":
        layout = [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0)]
    np.testing.assert_allclose(c[: len(layout)], [full[place] for place in layout], atol=ROUNDING)
    numbers = harmonic_numbers(10, order)
    assert len(c) == count(10, order) == (100 if order == "max" else 55)
    for k in range(1, 11):
        np.testing.assert_allclose(
            np.sort(c[numbers == k]), np.sort(full[number == k]), atol=ROUNDING, err_msg=f"harmonic {k}"
        )


@pytest.mark.parametrize("order", ORDERS)
def test_fewer_harmonics_are_the_first_part_of_more(noise, order):
    few, many = (st.contour.harmonics(noise, n, order) for n in (4, 9))
    np.testing.assert_array_equal(few, many[: len(few)])


def test_all_harmonics_give_the_mask_back_to_the_pixel(noise):
    np.testing.assert_array_equal(st.contour.silhouette(st.contour.harmonics(noise, 64), 64), noise)
    np.testing.assert_allclose(
        series(st.contour.harmonics(noise, 64), (64, 64)), 2.0 * noise - 1, atol=ROUNDING
    )


def test_a_series_can_be_drawn_at_any_size():
    c = st.contour.harmonics(disc(64, 20), 20)
    assert st.metrics.iou(st.contour.silhouette(c, (256, 256)), disc(256, 80)) > SMOOTH_IOU
    assert st.contour.silhouette(c, (30, 50)).shape == (30, 50)


def test_a_level_set_is_the_distance_to_the_circle_negative_inside():
    c = st.contour.harmonics(disc(64, 20.0), 64)
    phi = st.contour.silhouette(c, 64, level_set=True)
    rows, columns = np.indices((64, 64))
    true = np.hypot(columns - 31.5, rows - 31.5) - 20.0
    near = np.abs(true) < 3
    assert phi.dtype == np.float32
    # Half a pixel is what the mask itself does not know of the circle; the mean has to be right.
    assert abs(float((phi - true)[near].mean())) < TO_AN_EIGHTH_PX + CURVED_PX
    assert phi[31, 31] < -18 < 10 < phi[0, 31]


def test_without_a_contour_the_level_set_is_everywhere_far_away():
    empty = np.array([-64.0, 0, 0, 0])
    assert (st.contour.silhouette(empty, 32, level_set=True) == np.float32(np.hypot(32, 32))).all()
    assert (st.contour.silhouette(-empty, 32, level_set=True) == -np.float32(np.hypot(32, 32))).all()


def test_a_mask_of_another_size_is_resampled_by_area():
    big = disc(256, 80)
    c = st.contour.harmonics(big, 10)
    shares = big.reshape(64, 4, 64, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(c, block_of(shares, 10, "max"), atol=FLOAT32)
    np.testing.assert_array_equal(
        st.contour.harmonics(255 * big.astype(np.uint8), 10), c, err_msg="uint8 is the same as bool"
    )
    np.testing.assert_array_equal(st.contour.harmonics(np.repeat(big, 2, axis=1)[:, ::2], 10), c)  # strides


def test_alignment_puts_the_centroid_in_the_middle_and_the_area_at_its_size():
    image = disc(200, 30, x=60, y=140)
    image[100:110, 60:130] = True
    aligned, T = st.contour.align(image)
    y, x = np.nonzero(aligned)
    assert abs(x.mean() - 31.5) < GRID_PX
    assert abs(y.mean() - 31.5) < GRID_PX
    assert np.sqrt(aligned.sum()) == pytest.approx(0.35 * 64, rel=0.02)  # a ragged edge of 80 pixels
    np.testing.assert_array_equal(transformed(image, T, 64), aligned)
    moved, _ = st.contour.align(np.roll(image, (5, 11), (0, 1)))
    np.testing.assert_array_equal(moved, aligned)
