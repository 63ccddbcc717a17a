# SPDX-License-Identifier: MIT
"""Marks of tests that need a CUDA device: they skip, and say so, where the build or the machine has none."""

import pytest

import sdftrack as st
from sdftrack import _core

REASON = "no CUDA device" if _core.cuda_build else "a build without CUDA (-C cmake.define.SDFTRACK_CUDA=ON)"
MARKS = [pytest.mark.gpu, pytest.mark.skipif(not st.cuda_available(), reason=REASON)]


def on_gpu(test):
    for mark in MARKS:
        test = mark(test)
    return test
