# SPDX-License-Identifier: MIT
"""Distances of a field on a GPU. Skips, and says so, where the build or the machine has no CUDA."""

import numpy as np
import pytest
from gpu_marks import on_gpu
from scipy.ndimage import gaussian_filter

import sdftrack as st
from sdftrack import _core

VOXEL_M, BAND_VOXELS = 0.005, 4
FAR_ATOL_VOXELS = 1e-4


def noise(*shape):
    return np.random.default_rng(5).normal(size=shape).astype(np.float32)


FIELDS = {
    "a stretched ball": lambda: 3 * st.SDF.sphere(0.05, voxels=33).values,
    "a bent box": lambda: np.sinh(20 * st.SDF.box((0.05, 0.09, 0.03), voxels=30).values),
    "a smooth field": lambda: gaussian_filter(noise(25, 17, 30), 3.0),
    "noise": lambda: noise(9, 10, 12),
    "two voxels an axis": lambda: noise(2, 2, 2),
    "a corner": lambda: np.fromfunction(lambda z, y, x: x + y + z - 1.5, (40, 12, 11)),
}


@on_gpu
@pytest.mark.parametrize("name", FIELDS)
def test_the_gpu_measures_what_the_cpu_does(name):
    phi = np.ascontiguousarray(FIELDS[name](), np.float32)
    cpu, gpu = (st.levelset.redistance(phi, VOXEL_M, device=d) for d in ("cpu", "cuda"))
    near = np.abs(cpu) < BAND_VOXELS * VOXEL_M
    np.testing.assert_array_equal(gpu[near], cpu[near])
    np.testing.assert_allclose(gpu, cpu, rtol=0, atol=FAR_ATOL_VOXELS * VOXEL_M)


@on_gpu
def test_an_evolution_on_the_gpu_measures_there_too():
    ball = st.SDF.sphere(0.05, voxels=24)
    ratio = (-ball.values / ball.voxel_size).astype(np.float32)
    cpu, gpu = (
        st.levelset.evolve(ball.values, ratio, 4, ball.voxel_size, redistance_every=2, device=d)
        for d in ("cpu", "cuda")
    )
    np.testing.assert_allclose(gpu, cpu, rtol=0, atol=FAR_ATOL_VOXELS * ball.voxel_size)


@on_gpu
def test_a_field_of_one_sign_is_refused_there_as_here():
    values = np.ones((9, 9, 9), np.float32)
    for device in (-1, 0):
        with pytest.raises(ValueError, match="got one sign only"):
            _core.redistance(values, VOXEL_M, 1, device)
