# SPDX-License-Identifier: MIT
"""A reconstruction on a GPU against the CPU's. Skips, and says so, where the build or the machine has no CUDA."""

import numpy as np
import pytest
from reconstruction_scene import CAMERA, first_mask, sequence

import sdftrack as st
from sdftrack import _core, metrics

REASON = "no CUDA device" if _core.cuda_build else "a build without CUDA (-C cmake.define.SDFTRACK_CUDA=ON)"
pytestmark = [
    pytest.mark.gpu,
    pytest.mark.slow,
    pytest.mark.skipif(not st.cuda_available(), reason=REASON),
]

VOXELS, FRAMES = 48, 5
POSE_ATOL = 1e-4  # m and rad: sums in another order, frame after frame
BAND_VOXELS, SHAPE_ATOL_VOXELS = 3, 0.01


def reconstructed(device):
    seq = sequence(FRAMES, 12.0)
    star = st.Reconstructor(CAMERA, voxels=VOXELS, device=device, threads=1)
    poses = [star.start(seq[0], mask=first_mask(seq)).pose]
    poses += [star.track(seq[k]).pose for k in range(1, FRAMES)]
    return star, poses


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


def test_the_thesis_method_evolves_on_the_gpu():
    shapes = []
    for device in ("cpu", "cuda"):
        seq = sequence(FRAMES, 12.0)
        star = st.Reconstructor(CAMERA, voxels=32, device=device, threads=1, evolution="printed")
        star.start(seq[0], mask=first_mask(seq))
        shapes.append(star.shape)
    assert_alike(*shapes)
