# SPDX-License-Identifier: MIT
"""Modules and classes under the names used in pickles of earlier versions."""

from __future__ import annotations

import importlib
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


class _Finder:
    """Import finder and loader, called by Python only for modules that are not found otherwise.

    Without the base classes of ``importlib.abc``, whose import would take most of the time of ``import sdftrack``.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        loader: Any = self
        return importlib.machinery.ModuleSpec(fullname, loader) if fullname in MODULES else None

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> None:
        """Let Python make the module."""

    def exec_module(self, module: ModuleType) -> None:
        today = importlib.import_module(MODULES[module.__name__])

        def attribute(name: str) -> Any:
            return getattr(today, CLASSES.get(name, name))

        module.__getattr__ = attribute  # type: ignore[method-assign]


def find_moved_modules() -> None:
    """Enable import of the old names."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())
