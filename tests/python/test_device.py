# SPDX-License-Identifier: MIT
"""Choosing a device: what is available is used, what is missing is named."""

import pytest

import sdftrack as st
from sdftrack import _core, device


def test_the_cpu_is_always_there():
    assert device.resolve_device("cpu") == "cpu"


def test_auto_is_cuda_exactly_where_it_can_be_used():
    assert device.resolve_device("auto") == ("cuda" if st.cuda_available() else "cpu")


@pytest.mark.parametrize("cuda_build", [False, True])
def test_cuda_without_a_device_or_build_says_which_is_missing(monkeypatch, cuda_build):
    monkeypatch.setattr(_core, "cuda_build", cuda_build)
    monkeypatch.setattr(_core, "cuda_available", lambda: False)
    missing = "no device answers" if cuda_build else r"no CUDA path.*SDFTRACK_CUDA=ON"
    with pytest.raises(RuntimeError, match=missing):
        device.resolve_device("cuda")
    assert device.resolve_device("auto") == "cpu"


def test_cuda_is_chosen_where_build_and_device_are_there(monkeypatch):
    monkeypatch.setattr(_core, "cuda_build", True)
    monkeypatch.setattr(_core, "cuda_available", lambda: True)
    assert device.resolve_device("cuda") == device.resolve_device("auto") == "cuda"


def test_another_word_is_refused():
    with pytest.raises(ValueError, match=r"device: expected one of .*got 'gpu'"):
        device.resolve_device("gpu")


def test_another_type_is_refused():
    with pytest.raises(TypeError, match=r"device: expected one of .*got int"):
        device.resolve_device(0)  # type: ignore[arg-type]
