# SPDX-License-Identifier: MIT
"""Superpixels on photographs: the short version of the experiment."""

from __future__ import annotations

import numpy as np
import pytest

import sdftrack as st
from experiments.superpixels.superpixels import curve, open_bsds
from experiments.superpixels.times import memory, photographs


def test_on_photographs_every_score_is_at_least_that_of_scikit_image(data_dir):
    """Four of the images, as `python -m experiments run superpixels` does with all of them."""
    from skimage.segmentation import slic as theirs

    if not (data_dir / "bsds").is_dir():
        pytest.skip(f"photographs absent: {data_dir / 'bsds'}")
    scenes = open_bsds(data_dir)[::5]
    n, recall, error, accuracy = curve(scenes, st.superpixels.slic, [500])[0]
    other = curve(scenes, theirs, [450, 800])
    beside = [np.interp(np.log(n), np.log(other[:, 0]), other[:, k]) for k in (1, 2, 3)]
    assert recall >= beside[0]
    assert error <= beside[1]
    assert accuracy >= beside[2]


def test_the_working_memory_and_the_labels_are_at_most_12_bytes_a_pixel_on_a_photograph(data_dir):
    if not (data_dir / "bsds").is_dir():
        pytest.skip(f"photographs absent: {data_dir / 'bsds'}")
    assert memory(photographs(data_dir)["leaves"]) <= 12
