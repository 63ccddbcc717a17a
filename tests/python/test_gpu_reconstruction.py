# SPDX-License-Identifier: MIT
"""A reconstruction on a GPU against the CPU's. Skips, and says so, where the build or the machine has no CUDA."""

import numpy as np
import pytest
from gpu_marks import MARKS
from reconstruction_scene import begun, sequence

import sdftrack as st
from sdftrack import metrics

pytestmark = [*MARKS, pytest.mark.slow]

VOXELS, FRAMES = 48, 5
POSE_ATOL = 1e-4  # m and rad: sums in another order, frame after frame
BAND_VOXELS, SHAPE_ATOL_VOXELS = 3, 0.01


def reconstructed(device):
    star, results = begun(FRAMES, sequence(FRAMES, 12.0), voxels=VOXELS, device=device)
    return star, [result.pose for result in results]


def assert_alike(a, b):
    """Two shapes agree beside the surface."""
    near = np.abs(a.values) < BAND_VOXELS * a.voxel_size
    assert near.any()
    np.testing.assert_allclose(b.values[near], a.values[near], rtol=0, atol=SHAPE_ATOL_VOXELS * a.voxel_size)


def test_the_gpu_reconstructs_what_the_cpu_does(tmp_path):
    cpu, expected = reconstructed("cpu")
    gpu, poses = reconstructed("cuda")
    assert (cpu.device, gpu.device.split(":")[0]) == ("cpu", "cuda")
    for a, b in zip(expected, poses, strict=True):
        assert max(metrics.pose_error(a, b)) < POSE_ATOL
    assert_alike(cpu.shape, gpu.shape)
    assert abs(len(gpu.mesh().vertices) - len(cpu.mesh().vertices)) < 0.01 * len(cpu.mesh().vertices)

    gpu.save(tmp_path / "star.npz")
    for device in ("cpu", "cuda"):
        again = st.Reconstructor.load(tmp_path / "star.npz", device=device)
        assert again.device.split(":")[0] == device
        assert_alike(gpu.shape, again.shape)
        assert again.track(sequence(FRAMES, 12.0)[FRAMES - 1]).pose is not None
