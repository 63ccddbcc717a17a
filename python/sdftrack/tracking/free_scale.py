# SPDX-License-Identifier: MIT
"""Shapes of known form and unknown scale: the core estimates it, and enlarges their volumes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from sdftrack.results import ScaleEstimate
from sdftrack.sdf import SDF


def free_scales(scale: Any, shapes: Sequence[Any], unknown: Any) -> list[bool]:
    """Which of the shapes have a free scale; `unknown`: whether the size of shape k is estimated anyway."""
    many = isinstance(scale, (list, tuple))
    given = list(scale) if many else [scale] * len(shapes)
    if len(given) != len(shapes):
        raise ValueError(f"scale: expected one or None per shape ({len(shapes)}), got {len(given)}")
    for k, one in enumerate(given):
        if one not in (None, "free"):
            raise ValueError(f"scale{f'[{k}]' if many else ''}: expected None or 'free', got {one!r}")
        if one and unknown(k):
            raise ValueError(f"scale: expected None for shape {k}, a Primitive, whose sizes are free anyway")
    return [one == "free" for one in given]


def enlarge(tracker: Any, k: int) -> None:
    """Give object k the volume, and its symmetry, that the core has enlarged."""
    shape: SDF = tracker.shapes[k]
    enlarged = tracker._core.enlarged_volume(k, shape.voxel_size)
    if enlarged is None:
        return
    values, voxel_m, origin = enlarged
    tracker.shapes[k] = SDF(values, voxel_m, origin, shape.colors)
    symmetry = tracker._symmetries[k]
    tracker._symmetries[k] = symmetry and symmetry.enlarged(voxel_m / shape.voxel_size)


def estimate(tracker: Any, k: int) -> ScaleEstimate:
    """Scale of object k over the volume that was given."""
    mean, sd = tracker._core.scale(k)
    return ScaleEstimate(math.exp(mean), math.exp(mean) * sd)
