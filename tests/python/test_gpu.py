# SPDX-License-Identifier: MIT
"""CUDA against the CPU, where the self-test does not compare them already. Each skips without CUDA, and says so."""

import pickle

import numpy as np
import pytest
from gpu_marks import REASON, on_gpu

import sdftrack as st
from sdftrack import _core, device
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
    assert device.resolve_device("auto") == "cpu"
    number = _core.cuda_devices()[0]
    assert [c for c in run_self_test(number) if not c.agrees] == []
    assert device.resolve_device("auto") == f"cuda:{number}"


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


@on_gpu
@pytest.mark.slow
@pytest.mark.parametrize(
    ("n_in", "options"),
    [
        (1, {}),
        (2, {"w_prune": 0.6}),
        (2, {"diagonal": True}),
        (3, {"penalty": 1e-4}),
        (3, {"update_D": False}),
    ],
)
def test_ten_thousand_updates_on_the_gpu_give_the_bits_of_the_cpu(n_in, options):
    cpu, gpu, x, _ = both_learn(n_in, 2, (4000, 1, 5999), init_D=30.0, **options)
    assert cpu == gpu
    np.testing.assert_array_equal(cpu.predict(x), gpu.predict(x))


@on_gpu
@pytest.mark.parametrize(
    "options", [{"diagonal": True}, {"add_threshold": 0.95, "w_prune": 0.5}, {"penalty": 1e-3}]
)
def test_fields_projections_and_pruning_of_six_inputs_on_the_gpu_are_those_of_the_cpu(options):
    cpu, gpu, _, _ = both_learn(6, 3, (300, 200), init_D=2.0, **options)
    assert cpu == gpu
    assert cpu.n_fields == gpu.n_fields
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
