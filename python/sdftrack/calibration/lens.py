# SPDX-License-Identifier: MIT
"""The parameters of a depth camera by name, and conversion to and from :class:`sdftrack.Camera`."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera

Array = NDArray[np.float64]

# In the core's order. Those that a Camera does not hold, with the value of a camera without them:
UNKNOWNS = ("fx", "fy", "cx", "cy", "skew", "k1", "k2", "depth_scale", "depth_offset")
EXTRA = {"skew": 0.0, "depth_scale": 1.0, "depth_offset": 0.0}


def check_free(free: Any) -> tuple[str, ...]:
    """`free` as a tuple of known names, each once."""
    if isinstance(free, str):
        raise TypeError(
            f"free: expected a sequence of names, got the string {free!r}; for a single name use ({free!r},)"
        )
    names = tuple(free)
    for name in names:
        if name not in UNKNOWNS:
            raise ValueError(f"free: expected names out of {', '.join(UNKNOWNS)}, got {name!r}")
    if not names or len(set(names)) < len(names):
        raise ValueError(f"free: expected at least one name, each once, got {names}")
    return names


def core_lens(camera: Camera, extra: dict[str, float] | None = None) -> Any:
    """The core's lens for a camera and the parameters not in Camera."""
    values = {**EXTRA, **(extra or {})}
    return _core.Lens(camera._core, values["skew"], values["depth_scale"], values["depth_offset"])


def camera_of(values: Sequence[float], like: Camera) -> Camera:
    """The camera with `values` (in the order of UNKNOWNS); everything else as in `like`."""
    named = dict(zip(UNKNOWNS, values, strict=True))
    lens = list(like.distortion)
    if named["k1"] or named["k2"]:
        lens = lens or [0.0] * 4
    if lens:
        lens[0], lens[1] = named["k1"], named["k2"]
    fx, fy, cx, cy = (float(named[name]) for name in ("fx", "fy", "cx", "cy"))
    return dataclasses.replace(like, fx=fx, fy=fy, cx=cx, cy=cy, distortion=tuple(lens))


def extra_of(values: Sequence[float]) -> dict[str, float]:
    """Skew (px), depth scale and depth offset (m) of `values`."""
    named = dict(zip(UNKNOWNS, values, strict=True))
    return {name: float(named[name]) for name in EXTRA}


def prior_sd(names: Sequence[str], camera: Camera) -> list[float]:
    """Generic prior of a depth camera (sd), used while there are few frames."""
    known = {
        "fx": 0.15 * camera.fx,
        "fy": 0.15 * camera.fy,
        "cx": 0.06 * camera.width,
        "cy": 0.06 * camera.width,
        "skew": 0.01 * camera.fx,
        "k1": 0.2,
        "k2": 0.2,
        "depth_scale": 0.05,
        "depth_offset": 0.02,
    }
    return [known[name] for name in names]
