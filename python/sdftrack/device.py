# SPDX-License-Identifier: MIT
"""Selection of the device (CPU or CUDA), and information about the build."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core

__all__ = ["cuda_available", "host_array", "info", "resolve_device"]

_DEVICES = ("cpu", "cuda", "auto")
_DLPACK_HOST, _DLPACK_CUDA = (1, 3), (2, 13)  # device types of DLPack: plain or pinned memory; CUDA


def cuda_available() -> bool:
    """Whether ``device="cuda"`` can be used: a build with CUDA, a driver and a device.

    >>> import sdftrack as st
    >>> device = "cuda" if st.cuda_available() else "cpu"
    """
    return bool(_core.cuda_available())


def resolve_device(device: str) -> Literal["cpu", "cuda"]:
    """Resolve the argument ``device`` of a public function to the device to use.

    Parameters
    ----------
    device : {"cpu", "cuda", "auto"}
        ``"auto"`` selects the GPU if :func:`cuda_available`, else the CPU.

    Returns
    -------
    {"cpu", "cuda"}

    Raises
    ------
    TypeError
        ``device`` is not a string.
    ValueError
        An unknown device.
    RuntimeError
        ``"cuda"`` without support in the build or without a device; the message says which of the two.
    """
    if not isinstance(device, str):
        raise TypeError(f"device: expected one of {_DEVICES}, got {type(device).__name__}")
    if device not in _DEVICES:
        raise ValueError(f"device: expected one of {_DEVICES}, got {device!r}")
    if device == "cpu" or (device == "auto" and not cuda_available()):
        return "cpu"
    if not _core.cuda_build:
        raise RuntimeError(
            'device="cuda": this build of sdftrack has no CUDA path; build one from source with '
            '"pip install . -C cmake.define.SDFTRACK_CUDA=ON", or use device="cpu"'
        )
    if not cuda_available():
        raise RuntimeError(
            'device="cuda": this build supports CUDA, but no CUDA device is available here (see nvidia-smi); '
            'use device="cpu"'
        )
    return "cuda"


def host_array(value: Any, name: str) -> NDArray[Any]:
    """Convert an array-like to a numpy array; arrays on a CUDA device are copied to the host.

    Parameters
    ----------
    value : array_like, or an array of CuPy, PyTorch, Numba, JAX on a CUDA device
        Arrays on a device need ``__cuda_array_interface__`` or DLPack (``__dlpack__``).
    name : str
        Name of the argument in error messages.

    Raises
    ------
    RuntimeError
        An array on a GPU and a build without CUDA.
    TypeError
        An element type in DLPack that numpy does not support.
    ValueError
        An array on the device that is not C-contiguous, or a device other than the CPU or CUDA.
    """
    if isinstance(value, np.ndarray):
        return value
    interface = getattr(value, "__cuda_array_interface__", None)
    if interface is not None:
        return _copied_from_cuda(interface, name)
    if hasattr(value, "__dlpack__") and hasattr(value, "__dlpack_device__"):
        place, _ = value.__dlpack_device__()
        if place not in _DLPACK_HOST:
            if place not in _DLPACK_CUDA:
                raise ValueError(
                    f"{name}: expected an array on the CPU or a CUDA device, got one on DLPack device type "
                    f"{int(place)}; copy it to the host first"
                )
            _need_cuda_build(name)
            return _core.copy_from_dlpack(value.__dlpack__(), name)
        if not hasattr(value, "__array__"):
            return np.from_dlpack(value)
    return np.asarray(value)


def _copied_from_cuda(interface: dict[str, Any], name: str) -> NDArray[Any]:
    _need_cuda_build(name)
    out = np.empty(interface["shape"], np.dtype(interface["typestr"]))
    strides = interface.get("strides")
    if strides is not None and tuple(strides) != out.strides:
        raise ValueError(f"{name}: expected a C-contiguous array on the GPU, got strides {tuple(strides)}")
    if out.size:
        _core.copy_from_cuda(interface["data"][0], out)
    return out


def _need_cuda_build(name: str) -> None:
    if not _core.cuda_build:
        raise RuntimeError(
            f"{name}: this array is on a GPU, but this build of sdftrack has no CUDA path; copy it to the host "
            "first (CuPy: .get(), PyTorch: .cpu().numpy())"
        )


def info() -> dict[str, Any]:
    """Version, build options, CPU features in use, GPU and threads, as plain values.

    >>> import sdftrack as st
    >>> st.info()["threads"] >= 1
    True
    """
    build = dict(getattr(_core, "build", {}))
    return {
        "version": _core.__version__,
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "platform": platform.platform(),
        "extension": str(_core.__file__),
        "compiler": build.get("compiler", "unknown"),
        "optimised": build.get("optimised"),
        "cuda_build": bool(_core.cuda_build),
        "cpu": _cpu_name(),
        "cpu_features_in_use": [_core.isa()],
        "cpu_features": list(_core.isas()),
        "gpu": _core.cuda_device_name() if cuda_available() else None,
        "cuda_available": cuda_available(),
        "cores": os.cpu_count() or 1,
        "threads": int(_core.thread_count(0)),
    }


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
