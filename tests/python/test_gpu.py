# SPDX-License-Identifier: MIT
"""CUDA against the CPU. Each of these skips, and says so, where the build or the machine has no CUDA."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack import _core

REASON = "no CUDA device" if _core.cuda_build else "a build without CUDA (-C cmake.define.SDFTRACK_CUDA=ON)"
needs_gpu = pytest.mark.skipif(not st.cuda_available(), reason=REASON)

# The GPU fuses a x + y into one rounding, the CPU does not: half a unit in the last place of a x.
FMA_ATOL = 2e-6


@pytest.fixture
def vectors():
    rng = np.random.default_rng(0)
    return rng.normal(size=(2, 1000)).astype(np.float32)  # not a multiple of the block size


def test_the_cpu_scales_and_adds(vectors):
    x, y = vectors
    np.testing.assert_array_equal(_core.scale_and_add(1.5, x, y), np.float32(1.5) * x + y)


@pytest.mark.gpu
@needs_gpu
def test_the_gpu_computes_what_the_cpu_does(vectors):
    x, y = vectors
    np.testing.assert_allclose(
        _core.scale_and_add(1.5, x, y, cuda=True), _core.scale_and_add(1.5, x, y), rtol=0, atol=FMA_ATOL
    )


@pytest.mark.gpu
@needs_gpu
def test_the_device_has_a_name():
    assert _core.cuda_device_name()


def test_an_array_of_another_dtype_is_refused_with_a_hint(vectors):
    x, y = vectors
    with pytest.raises(TypeError, match=r"x: expected float32, got float64 \(1000,\).*ascontiguousarray"):
        _core.scale_and_add(1.5, x.astype(float), y)


def test_lengths_that_differ_are_refused(vectors):
    x, y = vectors
    with pytest.raises(ValueError, match="expected x and y of one length, got 1000 and 999"):
        _core.scale_and_add(1.5, x, y[:-1])


@pytest.mark.skipif(_core.cuda_build, reason="a build with CUDA")
def test_a_cpu_build_says_how_to_get_cuda(vectors):
    x, y = vectors
    with pytest.raises(RuntimeError, match="SDFTRACK_CUDA=ON"):
        _core.scale_and_add(1.5, x, y, cuda=True)
