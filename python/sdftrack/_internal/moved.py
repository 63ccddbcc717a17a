# SPDX-License-Identifier: MIT
"""Modules and classes under the names used in pickles of earlier versions."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

__all__ = ["find_moved_modules"]

# Only what a pickle can name: old module -> module today, old class -> class today.
MODULES = {
    "sdftrack.energy_state": "sdftrack.energy.state",
    "sdftrack.plane": "sdftrack.imaging.plane",
    "sdftrack.tracking.saving": "sdftrack.tracking.pickling",
    "sdftrack.reconstruction.shots": "sdftrack.reconstruction.keyframe",
    "sdftrack.reconstruction.keyframes": "sdftrack.reconstruction.keyframe_selection",
    "sdftrack.reconstruction.beginning": "sdftrack.reconstruction.initialization",
}
CLASSES = {"Shot": "Keyframe"}


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Import finder, called by Python only for modules that are not found otherwise."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        return importlib.machinery.ModuleSpec(fullname, self) if fullname in MODULES else None

    def exec_module(self, module: ModuleType) -> None:
        today = importlib.import_module(MODULES[module.__name__])

        def attribute(name: str) -> Any:
            return getattr(today, CLASSES.get(name, name))

        module.__getattr__ = attribute  # type: ignore[method-assign]


def find_moved_modules() -> None:
    """Enable import of the old names."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())
