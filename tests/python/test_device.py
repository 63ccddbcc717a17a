# SPDX-License-Identifier: MIT
"""Choosing a device: what is available is used, what is missing is named."""

import pickle

import numpy as np
import pytest
from refusals import assert_refused, refused

import sdftrack as st
from sdftrack import _core, device
from sdftrack.testing import self_test


@pytest.fixture
def record(tmp_path, monkeypatch):
    """No self-test is remembered from before."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


@pytest.fixture
def two_gpus(monkeypatch, record):
    monkeypatch.setattr(_core, "cuda_build", True)
    monkeypatch.setattr(_core, "cuda_devices", lambda: [0, 2])
    monkeypatch.setattr(_core, "cuda_fingerprint", lambda number: f"a GPU {number}, driver 1")


def test_auto_is_a_gpu_once_it_has_passed_its_self_test(two_gpus, monkeypatch):
    assert device.resolve_device("auto") == "cpu"
    device.remember(2, True)
    assert device.resolve_device("auto") == "cpu"  # another one
    device.remember(0, False)
    assert device.resolve_device("auto") == "cpu"
    device.remember(0, True)
    assert device.resolve_device("auto") == "cuda:0"
    monkeypatch.setattr(_core, "cuda_fingerprint", lambda number: f"a GPU {number}, driver 2")
    assert device.resolve_device("auto") == "cpu"


BALL = st.SDF.sphere(0.05, voxels=20)
CAMERA = st.Camera(fx=130, fy=130, cx=79.5, cy=59.5, width=160, height=120)


@pytest.fixture
def made_on(monkeypatch):
    """Devices that trackers are made on; the core that is made is that of the CPU."""
    devices, made = [], _core.Tracker
    monkeypatch.setattr(_core, "Tracker", lambda *a: devices.append(a[6]) or made(*a[:6], -1, *a[7:]))
    return devices


def test_auto_of_a_tracker_is_a_gpu_once_it_has_passed_its_self_test(two_gpus, made_on):
    tracker = st.Tracker([BALL, BALL], CAMERA)
    assert tracker.device == "cpu"
    device.remember(0, True)
    assert st.Tracker([BALL, BALL], CAMERA).device == "cuda:0"
    assert st.Tracker(BALL, CAMERA, device="cpu").device == "cpu"
    assert made_on == [-1, 0, -1]
    assert pickle.loads(pickle.dumps(tracker)).device == "cuda:0"  # a copy takes what is there now


def test_auto_of_a_reconstruction_is_a_gpu_once_it_has_passed_its_self_test(two_gpus):
    star = st.Reconstructor(CAMERA)
    assert star.device == "cpu"
    device.remember(0, True)
    assert st.Reconstructor(CAMERA).device == "cuda:0"
    assert pickle.loads(pickle.dumps(star)).device == "cuda:0"
    given = st.Reconstructor(CAMERA, device="cpu")
    assert pickle.loads(pickle.dumps(given)).device == "cpu"


@pytest.mark.parametrize("text", ["", "[1]", "{", "[" * 100000, "null"])
def test_a_damaged_record_is_no_record(two_gpus, text):
    device.remember(0, True)
    device.record_path().write_text(text)
    assert device.resolve_device("auto") == "cpu"
    device.remember(0, True)
    assert device.resolve_device("auto") == "cuda:0"


def test_a_self_test_that_cannot_run_has_failed(two_gpus, monkeypatch):
    def fails(device):
        raise RuntimeError("CUDA: cudaMalloc: no memory")

    def compared(compute, difference=0.0):
        return compute, lambda cpu, gpu: difference, 1.0

    monkeypatch.setattr(self_test, "COMPARISONS", {"a": compared(str), "b": compared(fails)})
    assert [c.agrees for c in self_test.run_self_test(0)] == [True, False]
    assert device.resolve_device("auto") == "cpu"
    monkeypatch.setattr(self_test, "COMPARISONS", {"a": compared(str)})
    assert self_test.run_self_test(0)[0].agrees
    assert device.resolve_device("auto") == "cuda:0"
    monkeypatch.setattr(self_test, "COMPARISONS", {"a": compared(str, float("nan"))})
    assert not self_test.run_self_test(0)[0].agrees
    assert device.resolve_device("auto") == "cpu"


@pytest.mark.parametrize("cuda_build", [False, True])
def test_cuda_without_a_device_or_build_says_which_is_missing(monkeypatch, cuda_build):
    monkeypatch.setattr(_core, "cuda_build", cuda_build)
    monkeypatch.setattr(_core, "cuda_devices", lambda: [])
    missing = "no CUDA device of capability" if cuda_build else r"no CUDA path.*SDFTRACK_CUDA=ON"
    with pytest.raises(RuntimeError, match=missing):
        device.resolve_device("cuda")
    assert device.resolve_device("auto") == "cpu"


def test_a_gpu_is_chosen_by_its_number(two_gpus):
    assert device.resolve_device("cuda") == "cuda:0"
    assert device.resolve_device("cuda:2") == "cuda:2"
    with pytest.raises(RuntimeError, match=r'device="cuda:1": expected one of .*cuda:0, cuda:2'):
        device.resolve_device("cuda:1")


@pytest.mark.parametrize(
    "name", ["gpu", 0, "cuda:", "cuda:-1", "cuda:1.5", "cuda:99999", "CUDA", "cuda:0 ", "cuda:٣"]
)
def test_a_name_that_is_none_is_refused(two_gpus, name):
    with pytest.raises((TypeError, ValueError, RuntimeError), match="device"):
        device.resolve_device(name)


FLAT = np.ones((9, 9), np.float32)


@pytest.mark.skipif(_core.cuda_build, reason="a build with CUDA")
@refused(
    (lambda: _core.scale_and_add(1.5, FLAT[0], FLAT[0], device=0), RuntimeError, "SDFTRACK_CUDA=ON"),
    (lambda: BALL.render(CAMERA, np.eye(4), device="cuda"), RuntimeError, "no CUDA path"),
    (lambda: BALL.to_mesh().raycast(CAMERA, np.eye(4), device="cuda"), RuntimeError, "no CUDA path"),
    (lambda: BALL.redistanced(device="cuda"), RuntimeError, "no CUDA path"),
    (lambda: _core.redistance(np.ones((2, 2, 2), np.float32), 0.01, 1, 0), RuntimeError, "no CUDA path"),
    (lambda: BALL.to_mesh(device="cuda"), RuntimeError, "no CUDA path"),
    (lambda: _core.zero_mesh(np.ones((2, 2, 2), np.float32), 0, 0), RuntimeError, "no CUDA path"),
    (
        lambda: _core.contour_steps(FLAT, FLAT, 1, _core.ContourOptions(), device=0),
        RuntimeError,
        "no CUDA path",
    ),
    (lambda: st.contour.ContourTracker(device="cuda"), RuntimeError, "no CUDA path"),
    (lambda: st.Tracker(BALL, CAMERA, device="cuda"), RuntimeError, "no CUDA path"),
    (lambda: st.LWPR().update([1.0, 2.0], 3.0, device="cuda"), RuntimeError, "no CUDA path"),
)
def test_a_build_without_cuda_says_how_to_get_it(call, error, words):
    assert_refused(call, error, words)


class ByDlpack:
    """An array that other libraries can only have by DLPack, as if it lay on a device of some type."""

    def __init__(self, values, device_type=1):
        self.values, self.device_type = values, device_type

    def __dlpack__(self, **_):
        return self.values.__dlpack__()

    def __dlpack_device__(self):
        return self.device_type, 0


DTYPES = [np.float32, np.float64, np.float16, np.uint8, np.uint16, np.int32, np.int64, np.bool_]


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", [(3, 4), (2, 0), (1, 5, 3), ()])
def test_a_dlpack_capsule_becomes_an_array_of_its_own(dtype, shape):
    values = np.arange(int(np.prod(shape)), dtype=np.int64).reshape(shape).astype(dtype)
    copied = _core.copy_from_dlpack(values.__dlpack__(), "x")
    assert copied.dtype == values.dtype
    assert np.array_equal(copied, values)
    assert not np.shares_memory(copied, values)


def test_an_array_on_the_host_comes_by_dlpack_without_a_copy():
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    assert np.shares_memory(device.host_array(ByDlpack(values), "x"), values)


def test_an_array_on_a_gpu_comes_by_dlpack_with_cuda_and_is_refused_without(monkeypatch):
    depth = np.full((48, 64), 0.7, np.float32)
    monkeypatch.setattr(_core, "cuda_build", False)
    with pytest.raises(RuntimeError, match=r"depth: this array is on a GPU.*copy it to the host"):
        st.Frame(ByDlpack(depth, 2))
    monkeypatch.setattr(_core, "cuda_build", True)
    assert np.array_equal(st.Frame(ByDlpack(depth, 2)).depth, depth)


def test_dlpack_that_cannot_be_taken_is_refused():
    values = np.ones((4, 4), np.float32)
    with pytest.raises(ValueError, match=r"x: expected an array on the CPU or a CUDA device, got .* type 10"):
        device.host_array(ByDlpack(values, 10), "x")
    with pytest.raises(ValueError, match="x: expected a C-contiguous array"):
        _core.copy_from_dlpack(values.T[1:].__dlpack__(), "x")
    with pytest.raises(TypeError, match="x: expected bool, integers or floats"):
        _core.copy_from_dlpack(values.astype(np.complex64).__dlpack__(), "x")
    with pytest.raises(TypeError, match="x: expected an unused DLPack capsule"):
        _core.copy_from_dlpack(None, "x")
    capsule = values.__dlpack__()
    _core.copy_from_dlpack(capsule, "x")
    with pytest.raises(TypeError, match="x: expected an unused DLPack capsule"):
        _core.copy_from_dlpack(capsule, "x")
