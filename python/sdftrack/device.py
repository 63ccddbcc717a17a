# SPDX-License-Identifier: MIT
"""Selection of the device (CPU or CUDA), and information about the build."""

from __future__ import annotations

import json
import os
import platform
import re
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.files import write_json
from sdftrack._internal.validation import detached

CPU = -1  # in place of the number of a GPU
_DEVICES = ("cpu", "cuda", "cuda:N", "auto")
_NAME = re.compile(r"cpu|auto|cuda(:(?P<number>\d{1,4}))?")
_LEGACY_STREAM = 1  # by the array API's number; its work is done before what is asked of it next
_DLPACK_HOST, _DLPACK_CUDA = (1, 3), (2, 13)  # device types of DLPack: plain or pinned memory; CUDA


def cuda_available() -> bool:
    """Whether ``device="cuda"`` can be used: a build with CUDA, a driver, and a device that the kernels are built for.

    >>> import sdftrack as st
    >>> device = "cuda" if st.cuda_available() else "cpu"
    """
    return bool(_core.cuda_devices())


def resolve_device(device: str) -> str:
    """Resolve the argument ``device`` of a public function to the device to use.

    Parameters
    ----------
    device : {"cpu", "cuda", "cuda:N", "auto"}
        ``"cuda"`` is the first device that can be used, ``"cuda:N"`` the one that CUDA numbers N. ``"auto"`` selects
        the first one if its self-test has passed (``sdftrack info --self-test``), else the CPU.

    Returns
    -------
    "cpu" or "cuda:N"

    Raises
    ------
    RuntimeError
        ``"cuda"`` without support in the build or without the device; the message says which of the two.
    """
    number = device_number(device)
    return "cpu" if number == CPU else f"cuda:{number}"


def device_number(device: str) -> int:
    """The number of a GPU, or `CPU`, from the argument ``device``; see `resolve_device`."""
    if not isinstance(device, str):
        raise TypeError(f"device: expected one of {_DEVICES}, got {type(device).__name__}")
    found = _NAME.fullmatch(device)
    if found is None:
        raise ValueError(f"device: expected one of {_DEVICES}, got {device!r}")
    if device == "cpu":  # without starting CUDA
        return CPU
    usable = _core.cuda_devices()
    if device == "auto":
        return usable[0] if usable and has_passed(usable[0]) else CPU
    if not _core.cuda_build:
        raise RuntimeError(
            f'device="{device}": this build of sdftrack has no CUDA path; build one from source with '
            '"pip install . -C cmake.define.SDFTRACK_CUDA=ON", or use device="cpu"'
        )
    if not usable:
        least = _core.cuda_least_capability() / 10
        raise RuntimeError(
            f'device="{device}": this build supports CUDA, but no CUDA device of capability {least:.1f} or later '
            'is available here (see nvidia-smi); use device="cpu"'
        )
    number = usable[0] if found["number"] is None else int(found["number"])
    if number not in usable:
        known = ", ".join(f"cuda:{k}" for k in usable)
        raise RuntimeError(f'device="{device}": expected one of the devices that are here, {known}')
    return number


def host_array(value: Any, name: str) -> NDArray[Any]:
    """An array-like as a numpy array, copied to the host from a CUDA device; errors name the argument."""
    # Arrays on a device need ``__cuda_array_interface__`` or DLPack, and to be C-contiguous.
    if isinstance(value, np.ndarray):
        return value
    value = detached(value)
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


class DeviceInput(NamedTuple):
    """An array of another library on a GPU: address, shape, type, the stream that is ordered after it, its owner."""

    address: int
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    stream: int
    owner: Any


def device_input(value: Any, name: str, number: int) -> DeviceInput | None:
    """`value` where it lies, C-contiguous, if that is GPU `number` and its library has DLPack; else None."""
    if number == CPU or not hasattr(value, "__dlpack_device__"):
        return None
    place, where = value.__dlpack_device__()
    if place != _DLPACK_CUDA[0] or where != number:
        return None
    _need_cuda_build(name)
    owner = _core.BorrowedArray(value.__dlpack__(stream=_LEGACY_STREAM))
    if not owner.contiguous:
        raise ValueError(
            f"{name}: expected a C-contiguous array on the GPU, got strides; make it contiguous first"
        )
    return DeviceInput(owner.address, owner.shape, owner.dtype, _LEGACY_STREAM, owner)


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
        "gpu": _core.cuda_device_name(_core.cuda_devices()[0]) if cuda_available() else None,
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


def record_path() -> Path:
    """The user's record of GPUs that have passed their self-test, in ``$XDG_CACHE_HOME`` or ``~/.cache``."""
    folder = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(folder) / "sdftrack" / "cuda_self_test.json"


def has_passed(number: int) -> bool:
    """Whether this build has passed the self-test on the device, with its present driver."""
    return _recorded().get(_record_key(number)) is True


def remember(number: int, passed: bool) -> None:
    """Write down the result of a self-test; where the user's folder cannot be written, it is known nowhere."""
    try:
        path = record_path()
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, {**_recorded(), _record_key(number): bool(passed)})
    except (OSError, RuntimeError):  # RuntimeError: the user has no home
        pass


def _recorded() -> dict[str, bool]:
    try:
        found = json.loads(record_path().read_text(encoding="utf-8"))
    except (OSError, ValueError, RuntimeError):
        return {}
    return found if isinstance(found, dict) else {}


def _record_key(number: int) -> str:
    built = Path(str(_core.__file__)).stat()
    return (
        f"sdftrack {_core.__version__}, {built.st_size}-{built.st_mtime_ns}: {_core.cuda_fingerprint(number)}"
    )
