# SPDX-License-Identifier: MIT
"""CUDA against the CPU, where the self-test does not compare them already. Each skips without CUDA, and says so."""

import pickle

import numpy as np
import pytest
from gpu_marks import REASON, on_gpu
from reconstruction_scene import begun, sequence

import sdftrack as st
from sdftrack import _core, metrics
from sdftrack import device as devices
from sdftrack.cli.app import run
from sdftrack.testing.self_test import run_self_test


class OnGpu:
    """What CuPy and PyTorch hand out: an address, a shape and a type."""

    def __init__(self, address=16, shape=(4, 6), typestr="<f4", strides=None):
        self.__cuda_array_interface__ = {
            "data": (address, False), "shape": shape, "typestr": typestr, "strides": strides, "version": 3,
        }  # fmt: skip


@pytest.mark.skipif(_core.cuda_build, reason="a build with CUDA")
def test_an_array_on_a_gpu_is_refused_by_a_cpu_build_with_a_way_out():
    with pytest.raises(RuntimeError, match=r"depth: this array is on a GPU.*no CUDA path.*\.cpu\(\)"):
        st.Frame(OnGpu())


@pytest.mark.skipif(not _core.cuda_build, reason=REASON)
def test_strides_on_a_gpu_are_refused():
    with pytest.raises(ValueError, match="depth: expected a C-contiguous array on the GPU"):
        st.Frame(OnGpu(strides=(4, 16)))


@on_gpu
def test_the_self_test_passes_and_auto_takes_the_gpu(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert devices.resolve_device("auto") == "cpu"
    number = _core.cuda_devices()[0]
    assert [c for c in run_self_test(number) if not c.agrees] == []
    assert devices.resolve_device("auto") == f"cuda:{number}"


@pytest.mark.skipif(st.cuda_available(), reason="a GPU is here")
def test_a_self_test_without_a_gpu_is_an_error(capsys):
    assert run(["info", "--self-test"]) == 1
    assert "CUDA" in capsys.readouterr().err


def both_learn(n_in, outputs, parts, **options):
    """One model from the CPU and one from the GPU, of the same samples."""
    rng = np.random.default_rng(n_in)
    x = rng.uniform(-1, 1, (sum(parts), n_in))
    y = np.stack([np.sin((3 + k) * x[:, k % n_in]) + x[:, -1] ** 2 for k in range(outputs)], axis=-1)
    models = [st.LWPR(n_in, outputs, norm_in=1.0, **options) for _ in range(2)]
    for model, where in zip(models, ("cpu", "cuda"), strict=True):
        start = 0
        for count in parts:
            model.update(x[start : start + count], y[start : start + count], device=where)
            start += count
    return *models, x, y


# Outputs, samples of each update, and the first metric.
MANY, FEW = (2, (4000, 1, 5999), 30.0), (3, (300, 200), 2.0)


@on_gpu
@pytest.mark.slow
@pytest.mark.parametrize(
    ("n_in", "of", "options"),
    [
        (1, MANY, {}), (2, MANY, {"w_prune": 0.6}), (2, MANY, {"diagonal": True}),
        (3, MANY, {"penalty": 1e-4}), (3, MANY, {"update_D": False}), (6, FEW, {"diagonal": True}),
        (6, FEW, {"add_threshold": 0.95, "w_prune": 0.5}), (6, FEW, {"penalty": 1e-3}),
    ],
)  # fmt: skip
def test_updates_on_the_gpu_give_the_bits_of_the_cpu(n_in, of, options):
    outputs, parts, init_D = of
    cpu, gpu, x, _ = both_learn(n_in, outputs, parts, init_D=init_D, **options)
    assert cpu == gpu
    np.testing.assert_array_equal(cpu.predict(x), gpu.predict(x))
    if "add_threshold" in options:
        assert max(f.n_projections for f in gpu.fields) > 2


@on_gpu
def test_a_model_learnt_on_the_gpu_goes_on_on_the_cpu(tmp_path):
    cpu, gpu, x, y = both_learn(2, 2, (300,), init_D=30.0)
    gpu.save(tmp_path / "model.lwpr")
    copies = [pickle.loads(pickle.dumps(gpu)), st.LWPR.load(tmp_path / "model.lwpr"), gpu.copy(), gpu]
    cpu.update(x[:50], y[:50])
    for one in copies:
        one.update(x[:50], y[:50])
        assert one == cpu
    for one in (cpu.update(x, y), gpu.update(x, y, device="cuda")):  # and on the GPU again
        assert one.n_samples == 650
    assert gpu == cpu


# -- a whole reconstruction
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


@on_gpu
@pytest.mark.slow
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


# -- arrays that lie on a GPU go in and come out without a copy
def there(array):
    return _core.DeviceArray.of(array, _core.cuda_devices()[0])


def picture():
    y, x = np.mgrid[:60, :90]
    return np.stack([2 * y, x, (x * y) % 97], axis=-1).astype(np.uint8)


def learnt():
    x = np.random.default_rng(0).uniform(-1, 1, (1000, 2))
    model = st.LWPR(2, 2)
    model.update(x, np.stack([np.sin(3 * x[:, 0]), x[:, 1] ** 2], axis=-1))
    return model


@on_gpu
@pytest.mark.parametrize("image", [picture(), picture()[..., 0].copy()], ids=["color", "grey"])
def test_labels_of_an_image_on_the_gpu_stay_there(image):
    labels = st.superpixels.slic(there(image), n_segments=40, device="cuda")
    assert isinstance(labels, _core.DeviceArray)
    assert labels.shape == image.shape[:2]
    np.testing.assert_array_equal(labels, st.superpixels.slic(image, n_segments=40, device="cpu"))


@on_gpu
def test_predictions_on_the_gpu_stay_there_also_where_no_field_is_active():
    model = learnt()
    x = np.random.default_rng(1).uniform(-1, 1, (500, 2))
    x[7] = 50
    said = model.predict(there(x), device="cuda")
    assert isinstance(said, _core.DeviceArray)
    np.testing.assert_array_equal(said, model.predict(x, device="cpu"))


@on_gpu
def test_a_nan_on_the_gpu_is_refused_as_one_of_the_host_is():
    x = np.zeros((9, 2))
    x[4, 1] = np.nan
    with pytest.raises(ValueError, match="NaN in sample 4"):
        learnt().predict(there(x), device="cuda")


@on_gpu
def test_an_array_of_another_type_is_copied():
    model = learnt()
    x = np.random.default_rng(1).uniform(-1, 1, (50, 2)).astype(np.float32)
    said = model.predict(there(x), device="cuda")
    assert isinstance(said, np.ndarray)
    np.testing.assert_array_equal(said, model.predict(x, device="cpu"))


@on_gpu
def test_an_array_says_where_it_lies_and_of_what_it_is():
    array = there(np.arange(6, dtype=np.float32).reshape(2, 3))
    assert (array.shape, array.dtype, len(array)) == ((2, 3), np.float32, 2)
    assert array.device == f"cuda:{_core.cuda_devices()[0]}"
    assert array.__dlpack_device__() == (2, _core.cuda_devices()[0])
    assert array.__cuda_array_interface__["shape"] == (2, 3)
    np.testing.assert_array_equal(array.host(), [[0, 1, 2], [3, 4, 5]])
    with pytest.raises(ValueError, match="stream"):
        array.__dlpack__(stream=0)


@on_gpu
def test_a_capsule_is_used_once():
    capsule = there(np.zeros(3)).__dlpack__()
    assert _core.BorrowedArray(capsule).shape == (3,)
    with pytest.raises(TypeError, match="unused DLPack capsule"):
        _core.BorrowedArray(capsule)


@on_gpu
@pytest.mark.parametrize("library", ["torch", "cupy", "jax"])
def test_other_libraries_take_and_give_arrays_without_a_copy(library):
    pytest.importorskip(library)
    image = picture()
    if library == "torch":
        import torch

        given = torch.from_numpy(image).cuda()
        take = torch.from_dlpack
    elif library == "cupy":
        import cupy

        given = cupy.asarray(image)
        take = cupy.from_dlpack
    else:
        import jax

        given = jax.device_put(image, jax.devices("gpu")[0])
        take = jax.dlpack.from_dlpack
    labels = st.superpixels.slic(given, n_segments=40, device="cuda")
    assert isinstance(labels, _core.DeviceArray)
    taken = take(labels)
    host = taken.get() if library == "cupy" else np.asarray(taken.cpu() if library == "torch" else taken)
    np.testing.assert_array_equal(host, st.superpixels.slic(image, n_segments=40, device="cpu"))
