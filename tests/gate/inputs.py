# SPDX-License-Identifier: MIT
"""What the runs share: a camera, and who makes the synthetic scenes."""

from __future__ import annotations

import importlib
from typing import Any

import sdftrack as st

Hashes = dict[str, str]
CAMERA = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)
# A commit before a move and one after it are compared by the same runs: a maker of scenes is taken from where it is.
SCENE_MODULES = ("sdftrack.synth", *(f"experiments.synth.{name}" for name in ("ball", "gait", "gait_video")))


def scene_maker(name: str) -> Any:
    """A function that makes synthetic scenes, by name, from the first of SCENE_MODULES that has it."""
    for module in SCENE_MODULES:
        try:
            return getattr(importlib.import_module(module), name)
        except (ImportError, AttributeError):
            continue
    raise AttributeError(f"{name}: in none of {', '.join(SCENE_MODULES)}")
