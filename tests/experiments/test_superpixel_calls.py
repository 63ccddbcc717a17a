# SPDX-License-Identifier: MIT
"""Another project's tests on our function: the import is all that changes, and each test is counted."""

from __future__ import annotations

from experiments.superpixels.scikit_image_tests import results_of, with_our_import

TEXT = """import numpy as np
from skimage.segmentation import slic

def test_right():
    assert slic.__module__.startswith("sdftrack.")
    assert slic(np.zeros((8, 8)), 4, channel_axis=None).shape == (8, 8)

def test_wrong():
    assert slic(np.zeros((8, 8)), 4, channel_axis=None).max() == 99
"""


def test_each_test_is_counted():
    assert results_of(with_our_import(TEXT)) == {"test_right": True, "test_wrong": False}
