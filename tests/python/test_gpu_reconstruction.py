# SPDX-License-Identifier: MIT
"""A reconstruction on a GPU against the CPU's. Skips, and says so, where the build or the machine has no CUDA."""

import numpy as np
import pytest
from gpu_marks import MARKS
from reconstruction_scene import CAMERA, begun, first_mask, sequence

import sdftrack as st
from sdftrack import metrics
from sdftrack.reconstruction import reconstructor

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


def test_the_tracker_reads_the_blocks_of_the_frame_before(monkeypatch):
    monkeypatch.setattr(reconstructor, "YOUNG_FRAMES", 0)  # from the first one on every second frame
    seq = sequence(FRAMES, 12.0)
    star = st.Reconstructor(CAMERA, voxels=32, extent=0.3, device="cuda", threads=1)  # does not grow
    star.start(seq[0], mask=first_mask(seq))
    held = star._volume.core.phi, star._volume.core.rgb_seen  # as the tracker's
    read = []
    track = st.Tracker.track

    def look(tracker, frame):
        before = [np.array(x) for x in held]
        star._volume.core.show()
        read.append([np.array_equal(a, b) for a, b in zip(before, held, strict=True)])
        return track(tracker, frame)

    monkeypatch.setattr(st.Tracker, "track", look)
    for k in range(1, FRAMES):
        was = np.array(held[0])
        star.track(seq[k])
        star._volume.core.show()
        assert not np.array_equal(was, held[0])
    assert read == [[True, True]] * (FRAMES - 1)


def test_the_thesis_method_evolves_on_the_gpu():
    shapes = []
    for device in ("cpu", "cuda"):
        star, _ = begun(1, sequence(FRAMES, 12.0), voxels=32, device=device, evolution="printed")
        shapes.append(star.shape)
    assert_alike(*shapes)
