# SPDX-License-Identifier: MIT
"""Pickles that ``Tracker.save`` and ``Reconstructor.save`` wrote in the past, read on request.

Only records of this package and arrays of numpy are made from them: any other name in the file is refused before
anything is called.
"""

from __future__ import annotations

import importlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from sdftrack._internal import saved_file
from sdftrack._internal.saved_file import FileKind, first_bytes
from sdftrack._internal.text_files import reason

__all__ = ["is_pickle", "loaded", "read"]

T = TypeVar("T")

PROTOCOLS = (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05")

# Old module -> module today, old class -> class today; the others have kept their places.
MODULES = {
    "sdftrack.tracking.saving": "sdftrack.tracking.pickling",
    "sdftrack.reconstruction.shots": "sdftrack.reconstruction.keyframe",
    "sdftrack.reconstruction.keyframes": "sdftrack.reconstruction.keyframe_selection",
    "sdftrack.reconstruction.beginning": "sdftrack.reconstruction.initialization",
}
CLASSES = {"Shot": "Keyframe"}
OURS = {
    "Ball", "Beginning", "Camera", "FirstView", "FreeSize", "FreeSizes", "Keyframe", "Keyframes", "Lattice",
    "MaskExtent", "Primitive", "PrimitiveFit", "RGBDCamera", "Reconstructor", "ReconstructorOptions", "SDF",
    "SensorModel", "SizeSum", "Status", "Steps", "Symmetry", "TrackResult", "Tracker", "TrackerOptions",
    "_primitive", "rebuild",
}  # fmt: skip
NUMPYS = {
    ("numpy", "dtype"), ("numpy", "ndarray"),
    ("numpy.core.multiarray", "_reconstruct"), ("numpy._core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"), ("numpy._core.multiarray", "scalar"),
    ("numpy.core.numeric", "_frombuffer"), ("numpy._core.numeric", "_frombuffer"),
}  # fmt: skip


def is_pickle(file: Path) -> bool:
    """Whether a file begins as pickles do."""
    return first_bytes(file, 2) in PROTOCOLS


def read(file: Path, file_kind: FileKind, kind: type[T], trust_pickle: bool) -> T:
    """Read an object of type `kind`; ValueError naming the file, without `trust_pickle` before it is read."""
    if not trust_pickle:
        raise ValueError(
            f"{file}: expected a file of {file_kind.writer}, got a pickle, as earlier versions wrote; if you trust "
            f"its source, read it by {kind.__name__}.load(path, trust_pickle=True) and save it again"
        )
    try:
        with file.open("rb") as opened:
            thing = _Restricted(opened).load()
    except OSError:
        raise
    # Whatever the calls in it raise; MemoryError of an array that declares too much.
    except Exception as error:
        told = reason(error)
        raise ValueError(
            f"{file}: expected a file of {file_kind.writer}, got an unreadable pickle ({told})"
        ) from None
    if not isinstance(thing, kind):
        raise ValueError(f"{file}: expected a saved {kind.__name__}, got {type(thing).__name__}")
    return thing


def loaded(
    path: str | os.PathLike[str],
    file_kind: FileKind,
    kind: type[T],
    trust_pickle: bool,
    state_from: Callable[[Any], dict[str, Any]],
) -> T:
    """An object of type `kind` with the state that `state_from` makes of a file's content, or of an earlier pickle."""
    file = saved_file.found(path, file_kind)
    if is_pickle(file):
        return read(file, file_kind, kind, trust_pickle)
    content = saved_file.read(file, file_kind)
    thing: Any = kind.__new__(kind)
    with saved_file.consistent(file, file_kind):
        thing.__setstate__(state_from(content))
    return cast(T, thing)


class _Restricted(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in NUMPYS:
            return getattr(importlib.import_module(module), name)
        module, name = MODULES.get(module, module), CLASSES.get(name, name)
        if module.startswith("sdftrack.") and name in OURS:
            return getattr(importlib.import_module(module), name)
        raise pickle.UnpicklingError(f"it names {module}.{name}, which no saved object needs")
